#include "bake/check/check_spheres.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace ist {
namespace {

double volume_of(const Sphere* spheres, std::size_t count) {
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double r = spheres[i].r;
    sum += r * r * r;
  }
  return 4 * std::numbers::pi / 3 * sum;
}

double distance(const Sphere& a, const Sphere& b) { return (centre(a) - centre(b)).norm(); }

/// Calls visit(i, j) for every pair whose extents along x overlap, j after i in that order. Pairs
/// that are not visited are apart along x.
template <class Visit>
Tally sweep(const Sphere* spheres, std::size_t count, const Visit& visit) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  const auto low = [&](std::uint32_t i) { return double{spheres[i].x} - double{spheres[i].r}; };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return low(a) != low(b) ? low(a) < low(b) : a < b;
  });
  return tally_all(count, [&](std::size_t k, Tally& tally) {
    const std::uint32_t i = order[k];
    const double high = double{spheres[i].x} + double{spheres[i].r};
    for (std::size_t m = k + 1; m < count && low(order[m]) <= high; ++m) visit(i, order[m], tally);
  });
}

}  // namespace

std::vector<std::vector<std::uint32_t>> overlapping_pairs(const Sphere* spheres,
                                                          std::size_t count) {
  std::vector<std::vector<std::uint32_t>> found(count);
  // Each call writes the list of its first sphere only.
  sweep(spheres, count, [&](std::uint32_t i, std::uint32_t j, Tally&) {
    const double sum = double{spheres[i].r} + double{spheres[j].r};
    if (std::fabs(double{spheres[i].y} - double{spheres[j].y}) > sum) return;
    if (distance(spheres[i], spheres[j]) < sum) found[i].push_back(j);
  });
  std::vector<std::vector<std::uint32_t>> both = found;
  for (std::uint32_t i = 0; i < count; ++i)
    for (const std::uint32_t j : found[i]) both[j].push_back(i);
  return both;
}

std::vector<Invariant> check_spheres(const AssetHeader& asset, const CheckedSolid& checked) {
  const std::size_t n = asset.sphere_count;
  const Sphere* inner = at<Sphere>(asset, asset.inner_spheres);
  const float* covers = at<float>(asset, asset.cover_radii);
  std::vector<Invariant> out;

  out.push_back(tally_all(n, [&](std::size_t i, Tally& tally) {
                  tally.add(1.0 - checked.winding(centre(inner[i])), i);
                }).named("centre inside solid", "1 − winding number of an inner sphere's centre"));
  out.push_back(tally_all(n,
                          [&](std::size_t i, Tally& tally) {
                            const double r = inner[i].r;
                            tally.add(r - checked.distance(centre(inner[i]), 2 * r + 1e-3), i);
                          })
                    .named("sphere clear of surface",
                           "radius − distance of the centre to the surface, unit frame"));
  out.push_back(
      sweep(inner, n, [&](std::uint32_t i, std::uint32_t j, Tally& tally) {
        const double sum = double{inner[i].r} + double{inner[j].r};
        tally.add(sum - distance(inner[i], inner[j]), std::max(i, j));
      }).named("spheres disjoint", "sum of two radii − distance of their centres, unit frame"));

  Tally coverage;
  // The mesh of a ball may contain less than the ball.
  const double covered = std::min(volume_of(inner, n) / asset.volume, 1.0);
  coverage.add(std::fabs(covered - asset.coverage) - 1e-9, 0);
  out.push_back(coverage.named("coverage",
                               "difference of Σ inner volumes / solid volume and the header, "
                               "above 1e-9"));
  out.push_back(tally_all(n, [&](std::size_t i, Tally& tally) {
                  tally.add(double{inner[i].r} - double{covers[i]}, i);
                }).named("cover holds sphere", "radius − cover radius, unit frame"));
  return out;
}

std::vector<Invariant> check_matched(const AssetHeader& asset, std::uint32_t detail,
                                     const CheckedMesh& checked, const std::string& name) {
  const std::size_t n = matched_tree(asset, detail).sphere_count;
  const Sphere* const matched = matched_spheres(asset, detail);
  const double stated =
      detail == 0 ? asset.protrusion : at<DetailLevel>(asset, asset.details)[detail - 1].protrusion;
  // The mesh approximates a solid whose surface may be this far from it.
  const double protrusion = stated - asset.polygonise_error;
  std::vector<Invariant> out;
  Tally sum;
  sum.add(std::fabs(volume_of(matched, n) / asset.volume - 1) - 1e-6, 0);
  out.push_back(sum.named(name + "matched volumes sum to the solid",
                          "relative difference of Σ matched volumes and the solid, above 1e-6"));
  out.push_back(
      tally_all(n,
                [&](std::size_t i, Tally& tally) {
                  const Eigen::Vector3d c = centre(matched[i]);
                  const double d = checked.distance(c, 100);
                  const double depth = checked.winding(c) >= 1 ? d : -d;
                  tally.add(matched[i].r - depth - protrusion - 1e-12, i);
                })
          .named(
              name + "matched protrusion",
              "protrusion of a matched sphere out of the solid − the asset's bound, unit frame"));
  return out;
}

}  // namespace ist
