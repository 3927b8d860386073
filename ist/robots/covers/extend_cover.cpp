#include <ist/cover_spheres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "robots/covers/triangles.h"

namespace ist {
namespace {

using Eigen::Vector3d;
using Corners = HalvableTriangle;

constexpr double kFineness =
    0.25;                        ///< a part is no wider than this share of the largest protrusion
constexpr double kGrowth = 0.1;  ///< by which spheres grow, of the largest protrusion
constexpr std::size_t kFewest = 8;  ///< spheres that may be added; else as many as exist
constexpr double kMargin = 1e-12;   ///< for rounding, of the coordinates

double farthest(const Corners& t, const Vector3d& from) {
  double square = 0;
  for (const Vector3d& corner : t) square = std::max(square, (corner - from).squaredNorm());
  return std::sqrt(square) + kMargin * (t[0].norm() + from.norm());
}

/// Finds the parts of a surface that are in no single sphere.
class OpenParts {
 public:
  OpenParts(std::vector<CoverSphere>& spheres, double growth, double finest)
      : spheres_(spheres), growth_(growth), finest_(finest) {}

  void look(const Corners& t) {
    CoverSphere* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (CoverSphere& sphere : spheres_) {
      const double lacks = farthest(t, sphere.centre) - sphere.radius;
      if (lacks <= 0) return;
      if (lacks < least) {
        least = lacks;
        best = &sphere;
      }
    }
    if (const LongestSide side = longest_side(t); side.length2 > finest_ * finest_) {
      for (const Corners& half : halves(t, side.from)) look(half);
      return;
    }
    // Growing costs little, and accumulates.
    const double grown = best == nullptr ? 0 : grown_[best - spheres_.data()] + least;
    if (best == nullptr || grown > growth_) return open.push_back(t);
    best->radius += least;
    grown_[best - spheres_.data()] = grown;
    most_grown = std::max(most_grown, grown);
  }

  std::vector<Corners> open;
  double most_grown = 0;

 private:
  std::vector<CoverSphere>& spheres_;
  const double growth_, finest_;
  std::map<std::ptrdiff_t, double> grown_;
};

/// Parts that one sphere must contain.
struct Cluster {
  std::vector<Corners> parts;
  Eigen::AlignedBox3d box;
  CoverSphere sphere;
  double reach = 0;  ///< bound on the distance of the sphere's points from the parts

  explicit Cluster(std::vector<Corners> given) : parts(std::move(given)) {
    for (const Corners& t : parts)
      for (const Vector3d& corner : t) box.extend(corner);
    sphere.centre = box.center();
    double nearest = std::numeric_limits<double>::infinity();
    for (const Corners& t : parts) {
      sphere.radius = std::max(sphere.radius, farthest(t, sphere.centre));
      for (const Vector3d& corner : t) nearest = std::min(nearest, (corner - sphere.centre).norm());
    }
    sphere.radius *= 1 + kMargin;
    reach = sphere.radius + nearest;
  }
};

}  // namespace

void extend_cover(const TriangleMesh& surface, SphereCover& cover) {
  Eigen::AlignedBox3d box;
  for (const auto& t : surface.triangles)
    for (const std::uint32_t v : t) box.extend(surface.vertices[v]);
  if (box.isEmpty()) return;
  double& largest = cover.protrusion.largest;
  const double finest = std::max(kFineness * largest, 1e-3 * box.diagonal().norm());
  OpenParts parts(cover.spheres, kGrowth * largest, finest);
  for (const auto& t : surface.triangles)
    parts.look({surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]});
  largest += parts.most_grown;
  if (parts.open.empty()) return;
  const std::size_t most = std::max(kFewest, cover.spheres.size());
  std::vector<Cluster> clusters;
  clusters.emplace_back(std::move(parts.open));
  while (clusters.size() < most) {
    const auto worst =
        std::max_element(clusters.begin(), clusters.end(),
                         [](const Cluster& a, const Cluster& b) { return a.reach < b.reach; });
    if (worst->reach <= largest || worst->parts.size() < 2) break;
    std::vector<Corners> one = std::move(worst->parts), other;
    int axis = 0;
    worst->box.sizes().maxCoeff(&axis);
    const auto middle = one.begin() + static_cast<std::ptrdiff_t>(one.size() / 2);
    std::nth_element(one.begin(), middle, one.end(), [&](const Corners& a, const Corners& b) {
      return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
    });
    other.assign(middle, one.end());
    one.erase(middle, one.end());
    *worst = Cluster(std::move(one));
    clusters.emplace_back(std::move(other));
  }
  for (const Cluster& cluster : clusters) {
    cover.spheres.push_back(cluster.sphere);
    largest = std::max(largest, cluster.reach);
  }
}

}  // namespace ist
