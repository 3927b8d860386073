#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "base/elementary.h"
#include "query/base/relative_pose.h"
#include "query/lod/unlike_sizes.h"

namespace ist {
namespace {

// For flat faces, depth u = volume / (|force| · skin) and gap follow the same curve for all solids
// tried (benchmarks/aligned): u is 0.13 … 0.19 as they touch and 0.22 … 0.28 at a fifth of the
// skin. Beyond that the volume is accurate to 10 %.
constexpr double kTouching = 0.135;
constexpr double kDeepOverlap = 0.225;
// d(log u) / d(log volume) along the correction: the force changes with the volume by it.
constexpr double kStiffening = 0.42;
// |force|³ / volume² over the depth is some hundreds for round contacts of the oracle's solids, and
// more than 5,000 for faces, up to the last sphere that touches.
constexpr double kRoundedRatio = 1500;
constexpr double kFlatRatio = 4500;

/// [u] Scale of the layer in which a solid's matched spheres protrude and leave gaps: their mean
/// radius, except for balls and the like, whose few large spheres fit better than that.
double skin_of(const PlacedAsset& placed) {
  const AssetHeader& asset = placed.asset.header();
  return std::ldexp(placed.scale, asset.exponent) *
         std::min(asset.matched_tree.mean_radius, 3 * asset.protrusion);
}

/// [u] The scale of two solids' layers together.
double skin_of(const PlacedAsset& a, const PlacedAsset& b) {
  const double of_a = skin_of(a), of_b = skin_of(b);
  return std::sqrt((of_a * of_a + of_b * of_b) / 2);
}

/// 1 for contacts of flat faces, 0 for round ones. `depth`: over the skin.
double flatness(double volume, double area, double depth) {
  const double ratio = area / volume;
  return smooth_step((ratio * ratio * area / depth - kRoundedRatio) / (kFlatRatio - kRoundedRatio));
}

/// The share of volume and force that remains at a depth < kDeepOverlap, over the skin.
struct Left {
  double volume, force;
};
Left left_at(double depth, double flat) {
  const double t = std::max((depth - kTouching) / (kDeepOverlap - kTouching), 0.0);
  const double volume = smooth_step(t);
  const double force =
      volume + kStiffening * depth * (smooth_slope(t) / (kDeepOverlap - kTouching));  // t < 1
  return {1 - flat * (1 - volume), 1 - flat * (1 - force)};
}

}  // namespace

Penetration without_protrusion(const Penetration& whole, const PlacedAsset& a,
                               const PlacedAsset& b) noexcept {
  if (a.asset.sphere_count() == 0 || b.asset.sphere_count() == 0 || !(whole.volume > 0))
    return whole;
  const double area = whole.force.norm();
  const double skin = skin_of(a, b);
  if (!(whole.volume < kDeepOverlap * (skin * area))) return whole;
  const double depth = whole.volume / (skin * area);
  const Left left = left_at(depth, flatness(whole.volume, area, depth));
  Penetration result = whole;
  result.volume *= left.volume;
  result.volume_min = std::min(result.volume_min, result.volume);
  result.force *= left.force;
  result.torque *= left.force;
  return result;
}

void without_protrusion(std::span<ContactPatch> patches, const PlacedAsset& a, const PlacedAsset& b,
                        const ContactSettings& settings) noexcept {
  if (a.asset.sphere_count() == 0 || b.asset.sphere_count() == 0 ||
      settings.measure != Measure::matched)
    return;
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose) return;
  if (pair_method(a, b, settings, pose).exact) return;
  const double skin = skin_of(a, b);
  const auto is_light = [&](const ContactPatch& patch) {
    return patch.volume < kDeepOverlap * (skin * patch.area);
  };
  // The light patches share one flatness; each has its own depth.
  double volume = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const ContactPatch& patch : patches)
    if (is_light(patch)) {
      volume += patch.volume;
      force += patch.force;
    }
  const double area = force.norm();
  if (!(volume > 0) || !(area > 0)) return;
  const double flat = flatness(volume, area, volume / (skin * area));
  for (ContactPatch& patch : patches) {
    if (!is_light(patch)) continue;
    const Left left = left_at(patch.volume / (skin * patch.area), flat);
    patch.volume *= left.volume;
    patch.area *= left.force;
    patch.force *= left.force;
    patch.torque *= left.force;
    patch.torsion *= left.force;
    patch.depth = patch.area > 0 ? patch.volume / patch.area : 0;
    if (patch.area > 0) continue;
    patch.normal.setZero();
    patch.point = patch.centroid;
  }
}

}  // namespace ist
