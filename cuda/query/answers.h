#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include <ist/gpu.h>

#include "cuda/query/lens_sums.h"
#include "query/base/members.h"
#include "query/base/pair_place.h"
#include "query/contact/contact_numbers.h"

// The answers of a batch. A row has the same members as the arrays that it is written to
// (GpuPenetrations …).

namespace ist::gpu {

struct PenetrationRow : WorldSums {
  Vec3 force, torque;  ///< on B
  QueryStatus status;
  std::uint32_t node_visits, sphere_pairs;
  double volume_min, volume_max;
  double contact_area = 0;
  Vec3 contact_normal = {0, 0, 0};
  bool touching = false;
};

/// The members of an answer that differ where solids touch.
struct ContactRow {
  double volume, volume_min, volume_max, contact_area;
  Vec3 centroid, contact_normal;
  bool touching;
};

struct SeparationRow {
  double distance, distance_min, distance_max;
  Vec3 point_a, point_b, normal;
  QueryStatus status;
  std::uint32_t node_visits, sphere_pairs;
};

struct PatchRow : PatchAxis {
  std::uint64_t id;
  double volume;
  Vec3 centroid, force, torque;
};

template <class T>
IST_HD void put(T* column, std::uint64_t i, const T& x) {
  column[i] = x;
}
IST_HD inline void put(double* column, std::uint64_t i, const Vec3& x) {
  for (int k = 0; k < 3; ++k) column[3 * i + static_cast<std::uint64_t>(k)] = x[k];
}

/// Writes row i of those arrays that the caller wants.
template <class Arrays, class Row>
IST_HD void write_row(const Arrays& to, std::uint64_t i, const Row& row) {
  for_each_member(
      [i](auto* column, const auto& x) {
        if (column != nullptr) put(column, i, x);
      },
      to, row);
}

/// Writes the answer of a pair without contact: zeros; or, if the status is an error, NaN
/// everywhere, as on the CPU (query/base/no_answer.h).
template <class Row>
IST_HD Row no_row(QueryStatus status) {
  Row row = {};
  row.status = status;
  if (status == QueryStatus::ok) return row;
  constexpr double kNone = NAN;
  for_each_member(
      [](auto& x) {
        if constexpr (std::is_same_v<decltype(x), double&>) x = kNone;
        if constexpr (std::is_same_v<decltype(x), Vec3&>) x = {kNone, kNone, kNone};
      },
      row);
  return row;
}

IST_HD inline void write_nothing(const GpuPenetrations& to, std::uint32_t i, QueryStatus status) {
  write_row(to, i, no_row<PenetrationRow>(status));
}

IST_HD inline WorldSums world_sums(const PairPlace& place, const double (&t)[kTerms]) {
  const auto sum = [&](double factor, int term) {
    return factor * Vec3{t[term], t[term + 1], t[term + 2]};
  };
  return WorldSums::of(place, kPi / 3 * t[kCaps], sum(-2 * kPi, kForce), sum(-2 * kPi, kTorque),
                       sum(kPi / 3, kMoment));
}
IST_HD inline WorldSums world_sums(const PairPlace& place, const LensTotals& totals) {
  // Without contact there is nothing to transform.
  return totals.spheres > 0 ? world_sums(place, totals.term) : WorldSums{};
}

IST_HD inline void write_answer(const GpuPenetrations& to, std::uint32_t i, const WorldSums& sums,
                                const LensTotals& totals) {
  write_row(
      to, i,
      PenetrationRow{sums, -sums.translation_gradient, -sums.rotation_gradient, QueryStatus::ok,
                     totals.visits, totals.spheres, sums.volume, sums.volume});
}

}  // namespace ist::gpu
