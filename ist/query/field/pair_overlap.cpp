#include "query/field/pair_overlap.h"

#include <ist/pair_fit.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "query/base/no_answer.h"
#include "query/base/smooth_step.h"
#include "query/base/turned_over.h"
#include "query/descent/answer.h"
#include "query/descent/descent.h"
#include "query/field/surface_descent.h"

namespace ist {
namespace {

// Ratio of grains up to which trees are summed by lenses alone, however light the contact; from
// which on light ones are summed by the surface; and from which on all are.
constexpr double kAlike = 1.25, kOther = 2, kUnlike = 4;
// A contact is light up to an overlap of so many spheres of the coarser grain: there lenses are 2 %
// and more in error, and few spheres meet the surface …
constexpr double kFewSpheres = 2;
// … if a sphere meets no more triangles than the one; never if it meets more than the other.
constexpr double kFewTriangles = 10, kManyTriangles = 20;
// The lenses answer alone from so many times that on.
constexpr double kHandover = 4;

/// How coarse a tree's spheres are for their solid, its unit frame: the mean radius, and more where
/// inner spheres cover little of it, the solid being thinner than its matched spheres.
double grain(const TreeHeader& tree, const AssetHeader& asset) {
  return tree.mean_radius / covered_part(asset);
}

/// About how many triangles of a surface a ball on it meets: those that a disc covers, and
/// those at its rim.
double triangles_met(const AssetHeader& asset, double radius) {
  const SurfaceHeader& surface = *at<SurfaceHeader>(asset, asset.surface);
  double side[3];
  for (int k = 0; k < 3; ++k)
    side[k] = surface.cell * static_cast<double>(kBrickWidth * surface.bricks[k]);
  // About the surface of a solid in such a box.
  const double area = side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
  const double covered = std::numbers::pi * (radius * radius) * surface.triangle_count / area;
  const double root = 1 + 1.6 * std::sqrt(covered);
  return root * root;
}

}  // namespace

PairMethod pair_method(const PlacedTree& a, const TreeHeader& tree_a, const PlacedTree& b,
                       const TreeHeader& tree_b, const RelativePose& pose,
                       SurfaceUse use) noexcept {
  PairMethod method;
  const double grain_a = grain(tree_a, a.tree.header());
  const double grain_b = grain(tree_b, b.tree.header()) * pose.a_from_b.scale;
  method.b_probes = grain_b <= grain_a;
  const double coarse = std::max(grain_a, grain_b);
  const double ratio = coarse / std::min(grain_a, grain_b);
  const bool has_surface = (method.b_probes ? a : b).tree.header().surface != 0;
  if (use == SurfaceUse::never || !has_surface) return method;
  if (use == SurfaceUse::always || ratio >= kUnlike) {
    method.surface = true;
    method.lenses = false;
    return method;
  }
  if (!(ratio > kAlike)) return method;
  // Grows without bound as the ratio does towards kUnlike.
  const double unlike = smooth_step((ratio - kAlike) / (kUnlike - kAlike));
  const double triangles =
      method.b_probes ? triangles_met(a.tree.header(), tree_b.mean_radius * pose.a_from_b.scale)
                      : triangles_met(b.tree.header(), tree_a.mean_radius / pose.a_from_b.scale);
  const double worth =
      1 - smooth_step((triangles - kFewTriangles) / (kManyTriangles - kFewTriangles));
  method.surface = worth > 0;
  method.share = smooth_step((ratio - kAlike) / (kOther - kAlike));
  method.full = worth * kFewSpheres * kBallVolume * (coarse * coarse * coarse) / (1 - unlike);
  method.none = kHandover * method.full;
  return method;
}

PairFit pair_fit(const PlacedTree& a, const PlacedTree& b) noexcept {
  PairFit fit;
  if (a.tree.sphere_count() == 0 || b.tree.sphere_count() == 0) return fit;
  if (!(a.scale > 0) || !(b.scale > 0)) return fit;
  const auto placed_grain = [](const PlacedTree& placed) {
    const AssetHeader& header = placed.tree.header();
    return std::ldexp(placed.scale * grain(header.matched_tree, header), header.exponent);
  };
  fit.grain_a = placed_grain(a);
  fit.grain_b = placed_grain(b);
  fit.a_is_coarser = fit.grain_b <= fit.grain_a;
  fit.ratio = std::max(fit.grain_a, fit.grain_b) / std::min(fit.grain_a, fit.grain_b);
  fit.has_surface = (fit.a_is_coarser ? a : b).tree.has_surface();
  fit.needs_surface = fit.ratio >= kUnlike;
  return fit;
}

namespace {

/// Weight and slope where lenses say `volume`, A's unit frame.
std::pair<double, double> weight_at(const PairMethod& method, double volume) noexcept {
  if (!method.surface) return {0, 0};
  if (!method.lenses || !(volume > method.full)) return {method.share, 0};
  const double width = method.none - method.full;
  const double t = (volume - method.full) / width;
  if (!(t < 1)) return {0, 0};
  return {method.share * (1 - smooth_step(t)), method.share * (-smooth_slope(t) / width)};
}

}  // namespace

SurfaceWeight surface_weight(const PairMethod& method, const Penetration& lenses,
                             double unit3) noexcept {
  const auto [weight, slope] = weight_at(method, lenses.volume / unit3);
  // It falls with the volume.
  return {weight, slope, weight_at(method, lenses.volume_max / unit3).first,
          weight_at(method, lenses.volume_min / unit3).first};
}

Penetration blended(const Penetration& lenses, Penetration sum, const SurfaceWeight& weight,
                    double unit3) noexcept {
  if (weight.least == 1) return sum;
  const double w = weight.weight;
  const double slope = weight.slope / unit3 * (sum.volume - lenses.volume);
  const double volume = w * sum.volume + (1 - w) * lenses.volume;
  // The weight is as sure as the lenses' volume; a blend is largest and least at its ends.
  const auto at = [](double part, double x, double y) { return part * x + (1 - part) * y; };
  const double lowest = std::min(at(weight.least, sum.volume_min, lenses.volume_min),
                                 at(weight.most, sum.volume_min, lenses.volume_min));
  const double highest = std::max(at(weight.least, sum.volume_max, lenses.volume_max),
                                  at(weight.most, sum.volume_max, lenses.volume_max));
  if (volume > 0)
    sum.centroid = (w * sum.volume / volume) * sum.centroid +
                   ((1 - w) * lenses.volume / volume) * lenses.centroid;
  sum.volume_min = std::max(0.0, lowest);
  sum.volume_max = highest;
  sum.volume = std::clamp(volume, sum.volume_min, sum.volume_max);
  sum.translation_gradient =
      w * sum.translation_gradient + (1 - w + slope) * lenses.translation_gradient;
  sum.rotation_gradient = w * sum.rotation_gradient + (1 - w + slope) * lenses.rotation_gradient;
  return sum;
}

Penetration PairOverlap::by_lenses(const DescentLimits& limits) noexcept {
  const SphereTree a(a_.tree.header(), tree_a_);
  const SphereTree b(b_.tree.header(), tree_b_);
  Descent descent(a, b, pose_, limits, scratch_);
  descent.run();
  return descent.penetration();
}

Penetration PairOverlap::by_surface(bool b_probes, const DescentLimits& limits,
                                    ContactBins* bins) noexcept {
  const PlacedTree& owner = b_probes ? a_ : b_;
  const PlacedTree& prober = b_probes ? b_ : a_;
  const SurfaceTree surface = surface_tree(owner.tree);
  const SphereTree probes(prober.tree.header(), b_probes ? tree_b_ : tree_a_);
  const double unit_b = pose_.unit_a * pose_.a_from_b.scale;
  const double most =
      std::min(tree_a_.volume_sum * pose_.unit3(), tree_b_.volume_sum * (unit_b * unit_b * unit_b));
  if (b_probes) {
    SurfaceDescent descent(surface, probes, pose_, limits, scratch_, bins);
    descent.run();
    return kept_within(most, descent.penetration());
  }
  const std::optional<RelativePose> turned = relative_pose(owner, prober);
  if (!turned) return invalid_input<Penetration>();
  SurfaceDescent descent(surface, probes, *turned, limits, scratch_, bins);
  descent.run();
  Penetration answer = kept_within(most, descent.penetration());
  turn_over(a_.pose, b_.pose, answer);
  return answer;
}

std::optional<DescentLimits> PairOverlap::left_by(const Penetration& lenses,
                                                  DescentLimits limits) noexcept {
  limits.spend(lenses.node_visits);
  if (limits.max_visits == 0) return std::nullopt;
  return limits;
}

Penetration PairOverlap::with_surface(const PairMethod& method, const Penetration& lenses,
                                      const SurfaceWeight& weight, const DescentLimits& left,
                                      ContactBins* bins) noexcept {
  Penetration sum = by_surface(method.b_probes, left, bins);
  sum.node_visits += lenses.node_visits;
  sum.sphere_pairs += lenses.sphere_pairs;
  sum.status = std::max(sum.status, lenses.status);
  return blended(lenses, sum, weight, pose_.unit3());
}

Penetration PairOverlap::without_surface(const PairMethod& method,
                                         Penetration lenses) const noexcept {
  // Of the surface's sum nothing is known but that it is no more than all that probes.
  const double scale = pose_.unit_a * (method.b_probes ? pose_.a_from_b.scale : 1.0);
  const double most = (method.b_probes ? tree_b_ : tree_a_).volume_sum * (scale * scale * scale);
  lenses.volume_min = 0;
  lenses.volume_max = std::max(lenses.volume_max, most * (1 + 1e-9));
  lenses.status = QueryStatus::budget_exhausted;
  return lenses;
}

Penetration PairOverlap::by(const PairMethod& method, const DescentLimits& limits) noexcept {
  if (!method.surface) return by_lenses(limits);
  if (!method.lenses) return by_surface(method.b_probes, limits);
  const Penetration lenses = by_lenses(limits);
  const SurfaceWeight weight = surface_weight(method, lenses, pose_.unit3());
  if (weight.most == 0) return lenses;
  const std::optional<DescentLimits> left = left_by(lenses, limits);
  if (!left) return without_surface(method, lenses);
  return with_surface(method, lenses, weight, *left);
}

}  // namespace ist
