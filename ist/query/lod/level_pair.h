#pragma once

#include <ist/asset_layout.h>
#include <cmath>
#include <cstdint>

#include "base/elementary.h"
#include "base/vec3.h"
#include "query/asset/shared_constants.h"
#include "query/base/pair_place.h"

// Costs and weights of levels of detail, on the CPU and on the GPU.

namespace ist {

/// The weight of unlike levels of detail for two copies of one asset that nearly coincide. If each
/// sphere lies on its copy, the sum of lenses is ∫ρ², where ρ, the number of spheres at a point, is
/// 1 in the mean but not everywhere: 6 to 9 % too much (docs/design.md 5). A level against the next
/// coarser one has other spheres and no such excess. So as copies approach coincidence, such unlike
/// levels take over: the mean of both orders, which has no force at coincidence.
struct CoincidenceWeight {
  double weight = 0;  ///< [0, 1]; 0 from a displacement of 1.6 mean radii on
  PoseSlope slope;
};

/// The weight for two copies of a tree: smooth in the pose, by the root mean square displacement of
/// equal points of the two, as if the tree filled its root ball.
IST_HD inline CoincidenceWeight coincidence_weight(const double (&root)[4], double mean_radius,
                                                   const Similarity& a_from_b) noexcept {
  const double(&m)[9] = a_from_b.m;
  const double(&t0)[3] = a_from_b.t;
  const double centre[3] = {root[0], root[1], root[2]};
  double moved[3];
  a_from_b.apply(centre, moved);
  const Vec3 displacement = {moved[0] - centre[0], moved[1] - centre[1], moved[2] - centre[2]};
  const Vec3 lever = {moved[0] - t0[0], moved[1] - t0[1], moved[2] - t0[2]};
  // The mean square of each coordinate over a ball is r²/5.
  const double spread = root[3] * root[3] / 5, scale = a_from_b.scale;
  const double turned = 3 * (scale * scale + 1) - 2 * ((m[0] + m[4]) + m[8]);
  const double square = dot(displacement, displacement) + spread * (turned > 0 ? turned : 0);
  CoincidenceWeight result;
  if (!(square < (kCopyApart * kCopyApart) * (mean_radius * mean_radius))) return result;
  const double distance = std::sqrt(square);
  const double part = (kCopyApart - distance / mean_radius) / (kCopyApart - kCopyAlone);
  result.weight = smooth_step(part);
  if (part >= 1) return result;
  const double slope = -smooth_slope(part) / ((kCopyApart - kCopyAlone) * mean_radius) / distance;
  result.slope.by_translation = slope * displacement;
  result.slope.by_rotation =
      slope * (cross(lever, displacement) - spread * Vec3{m[5] - m[7], m[6] - m[2], m[1] - m[3]});
  return result;
}

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
