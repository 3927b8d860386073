#pragma once

#include "query/exact/exact_sums.h"

namespace ist {

/// Sums of terms in eight slots: a term's slot is its place in the order of its kind. On the host
/// and on a GPU.
class SlotSums {
 public:
  IST_HD void add_triangles(const ExactTerms& terms) noexcept {
    add_volumes(terms.six_volumes[0]);
    for (int k = 0; k < 3; ++k) add_to(moment_[k], terms.moment[k]);
    add_to(rounding_, terms.rounding);
  }

  IST_HD void add_crossings(const ExactTerms& terms) noexcept {
    add_triangles(terms);
    add_volumes(terms.six_volumes[1]);
    add_volumes(terms.six_volumes[2]);
    for (int k = 0; k < 3; ++k) {
      add_to(force_[k], terms.force[k]);
      add_to(torque_[k], terms.torque[k]);
    }
  }

  // The same for lane l alone.
  IST_HD void add_triangle(const ExactTerms& terms, std::uint32_t l) noexcept {
    add_volume(terms.six_volumes[0], l);
    for (int k = 0; k < 3; ++k) moment_[k][l] += terms.moment[k][l];
    rounding_[l] += terms.rounding[l];
  }
  IST_HD void add_crossing(const ExactTerms& terms, std::uint32_t l) noexcept {
    add_triangle(terms, l);
    add_volume(terms.six_volumes[1], l);
    add_volume(terms.six_volumes[2], l);
    for (int k = 0; k < 3; ++k) {
      force_[k][l] += terms.force[k][l];
      torque_[k][l] += terms.torque[k][l];
    }
  }

  IST_HD ExactSums total() const noexcept {
    ExactSums out;
    for (int l = 0; l < 8; ++l) {
      out.six_volumes.add(high_[l]);
      out.six_volumes.add(low_[l]);
      out.moment = out.moment + exact::Point{moment_[0][l], moment_[1][l], moment_[2][l]};
      out.force = out.force + exact::Point{force_[0][l], force_[1][l], force_[2][l]};
      out.torque = out.torque + exact::Point{torque_[0][l], torque_[1][l], torque_[2][l]};
    }
    return out;
  }

  IST_HD double rounding() const noexcept {
    double sum = 0;
    for (const double r : rounding_) sum += r;
    return sum;
  }

 private:
  IST_HD static void add_to(double (&sums)[8], const double (&from)[8]) {
    for (int l = 0; l < 8; ++l) sums[l] += from[l];
  }
  IST_HD void add_volume(const double (&six_volumes)[8], std::uint32_t l) noexcept {
    double rest;
    exact::two_sum(high_[l], six_volumes[l], high_[l], rest);
    low_[l] += rest;
  }
  IST_HD void add_volumes(const double (&six_volumes)[8]) noexcept {
    for (std::uint32_t l = 0; l < 8; ++l) add_volume(six_volumes, l);
  }

  double high_[8] = {}, low_[8] = {};
  double moment_[3][8] = {}, force_[3][8] = {}, torque_[3][8] = {}, rounding_[8] = {};
};

}  // namespace ist
