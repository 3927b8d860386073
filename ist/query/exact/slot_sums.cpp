#include "query/exact/slot_sums.h"

namespace ist {
namespace {

using exact::Point;

void add_to(double (&sums)[8], const double (&from)[8]) {
  for (int l = 0; l < 8; ++l) sums[l] += from[l];
}

}  // namespace

void SlotSums::add_volumes(const double (&six_volumes)[8]) noexcept {
  for (int l = 0; l < 8; ++l) {
    double rest;
    exact::two_sum(high_[l], six_volumes[l], high_[l], rest);
    low_[l] += rest;
  }
}

void SlotSums::add_triangles(const ExactTerms& terms) noexcept {
  add_volumes(terms.six_volumes[0]);
  for (int k = 0; k < 3; ++k) add_to(moment_[k], terms.moment[k]);
  add_to(rounding_, terms.rounding);
}

void SlotSums::add_crossings(const ExactTerms& terms) noexcept {
  add_triangles(terms);
  add_volumes(terms.six_volumes[1]);
  add_volumes(terms.six_volumes[2]);
  for (int k = 0; k < 3; ++k) {
    add_to(force_[k], terms.force[k]);
    add_to(torque_[k], terms.torque[k]);
  }
}

ExactSums SlotSums::total() const noexcept {
  ExactSums out;
  for (int l = 0; l < 8; ++l) {
    out.six_volumes.add(high_[l]);
    out.six_volumes.add(low_[l]);
    out.moment = out.moment + Point{moment_[0][l], moment_[1][l], moment_[2][l]};
    out.force = out.force + Point{force_[0][l], force_[1][l], force_[2][l]};
    out.torque = out.torque + Point{torque_[0][l], torque_[1][l], torque_[2][l]};
  }
  return out;
}

double SlotSums::rounding() const noexcept {
  double sum = 0;
  for (const double r : rounding_) sum += r;
  return sum;
}

void add_triangle_term(const ExactTerms& terms, std::uint32_t l, ExactSums& sums) noexcept {
  sums.six_volumes.add(terms.six_volumes[0][l]);
  sums.moment = sums.moment + Point{terms.moment[0][l], terms.moment[1][l], terms.moment[2][l]};
}

void add_crossing_term(const ExactTerms& terms, std::uint32_t l, ExactSums& sums) noexcept {
  add_triangle_term(terms, l, sums);
  sums.six_volumes.add(terms.six_volumes[1][l]);
  sums.six_volumes.add(terms.six_volumes[2][l]);
  sums.force = sums.force + Point{terms.force[0][l], terms.force[1][l], terms.force[2][l]};
  sums.torque = sums.torque + Point{terms.torque[0][l], terms.torque[1][l], terms.torque[2][l]};
}

}  // namespace ist
