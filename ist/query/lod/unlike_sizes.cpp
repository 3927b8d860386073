#include "query/lod/unlike_sizes.h"

#include <ist/mass_properties.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/elementary.h"
#include "query/asset/sphere_tree.h"
#include "query/base/no_answer.h"
#include "query/base/solid_bounds.h"
#include "query/lod/wanted_error.h"
#include "query/tree_overlap/descent.h"

namespace ist {
namespace {

// The ratio of feature sizes up to which lenses answer alone, from which on the meshes answer light
// contacts, and from which on they answer all.
constexpr double kRatioLensOnly = 1.25, kRatioLight = 2, kRatioExactOnly = 4;
// A contact is light up to an overlap of this many spheres of the coarser solid: there lenses err
// by 2 % and more, and few triangles cross …
constexpr double kFewSpheres = 2;
// … if a sphere overlaps at most the first number of triangles, and never from the second on.
constexpr double kFewTriangles = 10, kManyTriangles = 20;
// Lenses answer alone from this multiple of a light contact's overlap on.
constexpr double kHandover = 4;

/// The feature size of an asset's spheres, unit frame: the mean radius, or more if inner spheres
/// cover little of the solid, which is then thinner than its matched spheres.
double feature_size(const AssetHeader& asset) {
  return asset.matched_tree.mean_radius / covered_part(asset);
}

/// The approximate number of triangles of a mesh that a ball on it overlaps, with those at its rim.
double triangles_in_ball(const AssetHeader& asset, double radius) {
  const MeshHeader& mesh = *at<MeshHeader>(asset, asset.mesh);
  double area = 0;
  for (const double part : at<BoxSums>(asset, mesh.level[mesh.level_count - 1].nodes)->area)
    area += part;
  const double covered = std::numbers::pi * (radius * radius) * mesh.triangle_count / area;
  const double root = 1 + 1.6 * std::sqrt(covered);
  return root * root;
}

/// `scale`: of B in A's unit frame.
PairMethod method_by_sizes(const AssetHeader& asset_a, const AssetHeader& asset_b, double scale) {
  PairMethod method;
  const double size_a = feature_size(asset_a), size_b = feature_size(asset_b) * scale;
  const double coarse = std::max(size_a, size_b);
  const double ratio = coarse / std::min(size_a, size_b);
  if (ratio >= kRatioExactOnly) return {false, true};
  if (!(ratio > kRatioLensOnly)) return method;
  const double unlike = smooth_step((ratio - kRatioLensOnly) / (kRatioExactOnly - kRatioLensOnly));
  const double triangles =
      size_b <= size_a ? triangles_in_ball(asset_a, asset_b.matched_tree.mean_radius * scale)
                       : triangles_in_ball(asset_b, asset_a.matched_tree.mean_radius / scale);
  const double worth =
      1 - smooth_step((triangles - kFewTriangles) / (kManyTriangles - kFewTriangles));
  method.exact = worth > 0;
  method.share = smooth_step((ratio - kRatioLensOnly) / (kRatioLight - kRatioLensOnly));
  // Grows without bound as the ratio approaches kRatioExactOnly.
  method.full = worth * kFewSpheres * kBallVolume * (coarse * coarse * coarse) / (1 - unlike);
  method.none = kHandover * method.full;
  return method;
}

/// Weight and slope at the spheres' `volume`, A's unit frame.
std::pair<double, double> weight_at(const PairMethod& method, double volume) noexcept {
  if (!method.exact) return {0, 0};
  if (!(volume > method.full)) return {method.share, 0};
  const double width = method.none - method.full;
  const double t = (volume - method.full) / width;
  if (!(t < 1)) return {0, 0};
  return {method.share * (1 - smooth_step(t)), method.share * (-smooth_slope(t) / width)};
}

}  // namespace

PairMethod pair_method(const PlacedAsset& a, const PlacedAsset& b,
                       const PenetrationSettings& settings,
                       const std::optional<RelativePose>& pose) noexcept {
  const bool mesh_alone = lack_spheres(a, b);
  // Assets of a mesh alone have no other measure.
  if (settings.measure == Measure::exact || (by_error(settings) && mesh_alone))
    return {false, true};
  if (settings.measure != Measure::matched || settings.spheres_only || mesh_alone || !pose ||
      !a.asset.has_mesh() || !b.asset.has_mesh())
    return {};
  const PairMethod method =
      method_by_sizes(a.asset.header(), b.asset.header(), pose->a_from_b.scale);
  // Under a wanted error blend_levels() uses the exact measure by itself.
  const bool has_own = by_error(settings) && settings.pair_budget == 0;
  return method.spheres && has_own ? PairMethod() : method;
}

SizeMatch size_match(const PlacedAsset& a, const PlacedAsset& b) noexcept {
  SizeMatch fit;
  if (a.asset.sphere_count() == 0 || b.asset.sphere_count() == 0) return fit;
  if (!(a.scale > 0) || !(b.scale > 0)) return fit;
  const auto placed_size = [](const PlacedAsset& placed) {
    const AssetHeader& header = placed.asset.header();
    return std::ldexp(placed.scale * feature_size(header), header.exponent);
  };
  fit.feature_size_a = placed_size(a);
  fit.feature_size_b = placed_size(b);
  fit.a_is_coarser = fit.feature_size_b <= fit.feature_size_a;
  fit.ratio = std::max(fit.feature_size_a, fit.feature_size_b) /
              std::min(fit.feature_size_a, fit.feature_size_b);
  fit.has_mesh = a.asset.has_mesh() && b.asset.has_mesh();
  fit.needs_mesh = fit.ratio >= kRatioExactOnly;
  return fit;
}

ExactWeight exact_weight(const PairMethod& method, const Penetration& spheres,
                         double unit3) noexcept {
  const auto [weight, slope] = weight_at(method, spheres.volume / unit3);
  // The weight falls with the volume.
  return {weight, slope, weight_at(method, spheres.volume_max / unit3).first,
          weight_at(method, spheres.volume_min / unit3).first};
}

std::optional<PenetrationSettings> left_for_exact(PenetrationSettings settings,
                                                  std::uint32_t spent) noexcept {
  DescentLimits limits = limits_of(settings);
  limits.spend(spent);
  if (limits.max_visits == 0) return std::nullopt;
  settings.measure = Measure::exact;
  settings.max_visits = limits.max_visits == DescentLimits::kNoLimit ? 0 : limits.max_visits;
  return settings;
}

Penetration without_exact(const PlacedAsset& a, const PlacedAsset& b,
                          Penetration spheres) noexcept {
  bound_by_solids(a, b, spheres);
  spheres.status = QueryStatus::budget_exhausted;
  return spheres;
}

Penetration blended(const Penetration& spheres, Penetration sum, const ExactWeight& weight,
                    double unit3) noexcept {
  sum.node_visits += spheres.node_visits;
  sum.sphere_pairs += spheres.sphere_pairs;
  sum.status = std::max(sum.status, spheres.status);
  if (weight.least == 1) return sum;
  const double w = weight.weight;
  const double slope = weight.slope / unit3 * (sum.volume - spheres.volume);
  const double volume = w * sum.volume + (1 - w) * spheres.volume;
  // The weight is as uncertain as the spheres' volume; a blend has its extremes at the weight's
  // ends.
  const auto at = [](double part, double x, double y) { return part * x + (1 - part) * y; };
  const double lowest = std::min(at(weight.least, sum.volume_min, spheres.volume_min),
                                 at(weight.most, sum.volume_min, spheres.volume_min));
  const double highest = std::max(at(weight.least, sum.volume_max, spheres.volume_max),
                                  at(weight.most, sum.volume_max, spheres.volume_max));
  if (volume > 0) {
    sum.centroid = (w * sum.volume / volume) * sum.centroid +
                   ((1 - w) * spheres.volume / volume) * spheres.centroid;
    sum.touching = false;
    sum.contact_area = 0;
    sum.contact_normal.setZero();
  }
  sum.volume_min = std::max(0.0, lowest);
  sum.volume_max = highest;
  sum.volume = std::clamp(volume, sum.volume_min, sum.volume_max);
  sum.force = w * sum.force + (1 - w + slope) * spheres.force;
  sum.torque = w * sum.torque + (1 - w + slope) * spheres.torque;
  return sum;
}

Penetration lens_sum(const PlacedAsset& a, const TreeHeader& tree_a, const PlacedAsset& b,
                     const TreeHeader& tree_b, const RelativePose& pose,
                     const DescentLimits& limits, Workspace::Impl& scratch) noexcept {
  const SphereTree of_a(a.asset.header(), tree_a), of_b(b.asset.header(), tree_b);
  Descent descent(of_a, of_b, pose, limits, scratch);
  descent.run();
  return descent.penetration();
}

}  // namespace ist
