#include <algorithm>
#include <cmath>

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "query/base/smooth_step.h"

namespace ist {
namespace {

// Where flat faces meet, depth u = volume / (|force| · skin) and gap follow the same curve for all
// solids tried (benchmarks/aligned): u is 0.13 … 0.19 as they touch, 0.22 … 0.28 when a fifth of
// the skin deep, and from there on the volume is right to 10 %.
constexpr double kTouching = 0.135;
constexpr double kDeep = 0.225;
// d(log u) / d(log volume) on the way, by which the force changes with the volume.
constexpr double kStiffening = 0.42;
// |force|³ / volume² over the depth: hundreds for round contacts of the oracle's solids, and from
// 5,000 on for faces, up to the last sphere that touches.
constexpr double kRound = 1500;
constexpr double kFlat = 4500;

/// [u] Scale of the layer in which a solid's matched spheres stick out and leave room: their mean
/// radius, but for balls and the like, whose few large spheres fit better than that.
double skin_of(const PlacedTree& placed) {
  const AssetHeader& asset = placed.tree.header();
  return std::ldexp(placed.scale, asset.exponent) *
         std::min(asset.matched_tree.mean_radius, 3 * asset.protrusion);
}

}  // namespace

Penetration without_protrusion(const Penetration& whole, const PlacedTree& a,
                               const PlacedTree& b) noexcept {
  if (a.tree.empty() || b.tree.empty() || !(whole.volume > 0)) return whole;
  const double area = whole.translation_gradient.norm();
  const double of_a = skin_of(a), of_b = skin_of(b);
  const double skin = std::sqrt((of_a * of_a + of_b * of_b) / 2);
  if (!(whole.volume < kDeep * (skin * area))) return whole;
  const double depth = whole.volume / (skin * area);
  const double ratio = area / whole.volume;
  const double flat = smooth_step((ratio * ratio * area / depth - kRound) / (kFlat - kRound));
  const double t = std::max((depth - kTouching) / (kDeep - kTouching), 0.0);
  const double volume = smooth_step(t);
  const double force =
      volume + kStiffening * depth * (6 * t * (1 - t) / (kDeep - kTouching));  // t < 1
  Penetration result = whole;
  result.volume *= 1 - flat * (1 - volume);
  result.volume_min = std::min(result.volume_min, result.volume);
  result.translation_gradient *= 1 - flat * (1 - force);
  result.rotation_gradient *= 1 - flat * (1 - force);
  return result;
}

}  // namespace ist
