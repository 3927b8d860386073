#pragma once

#include <cmath>
#include <cstdint>

#include <ist/asset_layout.h>

#include "base/plain.h"
#include "query/asset/shared_constants.h"
#include "query/base/smooth_step.h"

// Costs and weights of levels of detail, on the CPU and on the GPU.

namespace ist {

/// A matched tree at a level of detail; lengths in its unit frame.
struct LevelCost {
  double reach;  ///< radius of the root ball
  double mean_radius, volume_sum, sphere_count;

  static LevelCost of(const TreeHeader& tree) noexcept {
    return {tree.root[3], tree.mean_radius, tree.volume_sum,
            static_cast<double>(tree.sphere_count)};
  }
};

/// A level of detail of each of two assets.
struct LevelPair {
  std::uint32_t a, b;  ///< 0: the finest

  // Factors of the expected number of sphere pairs, A's unit frame.
  double density;  ///< pairs per volume of overlap
  double skin;     ///< √volume: for the rim of shallow contacts
};

/// The weight of a pair of levels in an answer.
struct LevelWeight {
  double weight;  ///< [0, 1]
  double slope;   ///< d weight / d estimate of the overlap

  IST_HD friend LevelWeight operator*(const LevelWeight& x, const LevelWeight& y) noexcept {
    return {x.weight * y.weight, x.slope * y.weight + x.weight * y.slope};
  }
  IST_HD friend LevelWeight operator+(const LevelWeight& x, const LevelWeight& y) noexcept {
    return {x.weight + y.weight, x.slope + y.slope};
  }
};
IST_HD inline LevelWeight complement(const LevelWeight& x) noexcept {
  return {1 - x.weight, -x.slope};
}

/// `scale`: of B in A's unit frame.
IST_HD inline LevelPair detail_pair(std::uint32_t a, const LevelCost& of_a, std::uint32_t b,
                                    const LevelCost& of_b, double scale) noexcept {
  const double volume_b = of_b.volume_sum * (scale * scale * scale);
  const double reach = of_a.mean_radius + of_b.mean_radius * scale;
  const double size = of_b.reach * scale < of_a.reach ? of_b.reach * scale : of_a.reach;
  return {a, b,
          kPairShare * (of_a.sphere_count / of_a.volume_sum) * (of_b.sphere_count / volume_b) *
              ball_volume(reach),
          kPairRim * reach * std::sqrt(size)};
}

/// Advances to the next coarser level of A, of B, or of both (LevelChain) if there are `more`.
/// Radii are the levels' mean radii, A's unit frame.
IST_HD inline void step_coarser(bool more_a, bool more_b, double radius_a, double radius_b,
                                std::uint32_t& a, std::uint32_t& b) noexcept {
  const double cube_a = radius_a * radius_a * radius_a;
  const double cube_b = radius_b * radius_b * radius_b;
  a += more_a && (!more_b || !(kAlikeVolume * cube_a > cube_b)) ? 1 : 0;
  b += more_b && (!more_a || !(kAlikeVolume * cube_b > cube_a)) ? 1 : 0;
}

/// The expected number of sphere pairs for an overlap, A's unit frame.
IST_HD inline double expected_pairs(const LevelPair& pair, double overlap) noexcept {
  return pair.density * (overlap + pair.skin * std::sqrt(overlap));
}

/// 1 if a pair of levels is expected to need no more than the fraction `alone` of the budget, 0
/// from `none` on; with its slope by the estimated overlap.
IST_HD inline LevelWeight affordable(const LevelPair& pair, double estimate, double budget,
                                     double alone, double none) noexcept {
  const double expected = expected_pairs(pair, estimate);
  // (a damaged asset's NaN selects the coarsest level)
  const double t = expected < none * budget ? (none - expected / budget) / (none - alone) : 0;
  if (!(t > 0 && t < 1)) return {smooth_step(t), 0};
  return {smooth_step(t), -smooth_slope(t) / ((none - alone) * budget) * pair.density *
                              (1 + pair.skin / (2 * std::sqrt(estimate)))};
}

}  // namespace ist
