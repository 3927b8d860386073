#pragma once

#include <ist/query.h>
#include <algorithm>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/lod/level_chain.h"
#include "query/lod/level_pair.h"
#include "query/lod/wanted_error.h"

namespace ist {

/// True if both are the same bytes and contain a coarser level.
inline bool are_one_asset(const AssetHeader& a, const AssetHeader& b) noexcept {
  return a.detail_count > 0 &&
         (&a == &b || (a.content_hash == b.content_hash && a.file_bytes == b.file_bytes));
}

/// (1 − weight) · x + weight · y.
inline Penetration mix(const Penetration& x, const Penetration& y, double weight) noexcept {
  const double rest = 1 - weight;
  Penetration result;
  result.volume = rest * x.volume + weight * y.volume;
  result.volume_min = rest * x.volume_min + weight * y.volume_min;
  result.volume_max = rest * x.volume_max + weight * y.volume_max;
  if (result.volume > 0)
    result.centroid = x.centroid + (weight * y.volume / result.volume) * (y.centroid - x.centroid);
  result.force = rest * x.force + weight * y.force;
  result.torque = rest * x.torque + weight * y.torque;
  result.status = std::max(x.status, y.status);
  result.node_visits = x.node_visits + y.node_visits;
  result.sphere_pairs = x.sphere_pairs + y.sphere_pairs;
  return result;
}

/// Adds the gradients of a mix by its weight. `step`: [u³] growth of the mix over weights 0 to 1.
inline void add_slope(const PoseSlope& slope, double step, const RelativePose& pose,
                      Penetration& mixed) noexcept {
  const Vec3 push = turned(step / pose.unit_a, pose.rotation_a, slope.by_translation);
  mixed.force -= vector(push);
  mixed.torque -=
      vector(turned(step, pose.rotation_a, slope.by_rotation) + cross(pose.offset_b, push));
}

/// Computes the part of a blend with the largest weight, which contact patches sort into bins.
class LargestPart {
 public:
  /// A pair of levels, in place of lens_sum().
  virtual Penetration level(const LevelPair& pair, const DescentLimits& limits) noexcept = 0;
  /// The exact measure, in place of ExactMeasure.
  virtual Penetration exact(const PenetrationSettings& settings) noexcept = 0;

 protected:
  ~LargestPart() = default;
};

/// penetration() by Measure::exact, a function above this folder.
using ExactMeasure = Penetration (*)(const PlacedAsset& a, const PlacedAsset& b,
                                     const PenetrationSettings& settings, const RelativePose& pose,
                                     Workspace& workspace) noexcept;

/// True if the answer of matched spheres depends on other levels than the finest.
inline bool asks_levels(const PlacedAsset& a, const PlacedAsset& b,
                        const PenetrationSettings& settings) noexcept {
  return settings.pair_budget > 0 || by_error(settings) ||
         are_one_asset(a.asset.header(), b.asset.header());
}

/// The penetration by levels of detail. Under a wanted error levels and the exact measure are
/// blended by their errors (WantedError), under a pair budget levels by their costs (LevelChain);
/// without either the finest answers. Copies of one asset that nearly coincide use unlike levels
/// (CoincidenceWeight). The gradients are those of the blended sum. `largest`, unless null, sums
/// the part of the largest weight. No allocation, lock or exception.
Penetration blend_levels(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
                         const PenetrationSettings& settings, Workspace& workspace,
                         ExactMeasure exact, LargestPart* largest = nullptr) noexcept;

}  // namespace ist
