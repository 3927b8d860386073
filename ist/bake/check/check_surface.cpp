#include "bake/check/check_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bake/check/check_tally.h"

namespace ist {
namespace {

using CheckCorners = CheckedMesh::Corners;
using Point = Eigen::Vector3d;

/// Every edge is run as often one way as the other.
Invariant closed(const std::vector<CheckCorners>& triangles) {
  using Key = std::array<double, 6>;
  std::map<Key, std::ptrdiff_t> balance;
  for (const CheckCorners& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Point &a = t[k], &b = t[(k + 1) % 3];
      const bool up = std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
      const Point &low = up ? a : b, &high = up ? b : a;
      balance[{low[0], low[1], low[2], high[0], high[1], high[2]}] += up ? 1 : -1;
    }
  Tally tally;
  std::size_t edge = 0;
  for (const auto& [key, sum] : balance) tally.add(static_cast<double>(std::abs(sum)), edge++);
  return tally.named("surface closed", "uses of an edge in one direction − uses in the other");
}

using Polygon = std::vector<Point>;  ///< convex

/// What of a polygon lies behind a plane, and what ahead of it; what lies in it counts as behind.
std::array<Polygon, 2> parts_by(const Polygon& polygon, const Point& on, const Point& normal) {
  constexpr double kIn = 1e-13;  // unit frame: so near is in the plane
  std::array<Polygon, 2> parts;
  const auto height = [&](const Point& p) {
    const double h = normal.dot(p - on);
    return std::abs(h) <= kIn ? 0.0 : h;
  };
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    const double from = height(p), to = height(q);
    if (from <= 0) parts[0].push_back(p);
    if (from >= 0) parts[1].push_back(p);
    if ((from < 0 && to > 0) || (from > 0 && to < 0)) {
      const Point between = p + from / (from - to) * (q - p);
      parts[0].push_back(between);
      parts[1].push_back(between);
    }
  }
  const auto any = [&](bool ahead) {
    return std::any_of(polygon.begin(), polygon.end(),
                       [&](const Point& p) { return ahead ? height(p) > 0 : height(p) < 0; });
  };
  if (!any(true))
    parts[1].clear();
  else if (!any(false))
    parts[0].clear();
  return parts;
}

/// Cut through the middle of its longest way across.
std::array<Polygon, 2> halves_of(const Polygon& polygon) {
  Point from = polygon[0], to = polygon[0];
  for (const Point& p : polygon)
    for (const Point& q : polygon)
      if ((q - p).squaredNorm() > (to - from).squaredNorm()) from = p, to = q;
  return parts_by(polygon, (from + to) / 2, (to - from).normalized());
}

/// Proves triangles within `error` of a surface: a part lies as near as its centre and its radius
/// say, or as its farthest corner from one triangle. Else it is cut along that triangle's sides,
/// so that where one triangle lies over several in its plane each has its part; else it is halved.
class NearProof {
 public:
  NearProof(const CheckedMesh& to, double error)
      : to_(to), error_(error * (1 + 1e-6) + 1e-11), smallest_(std::max(1e-3 * error, 1e-9)) {}

  void prove(const CheckCorners& part, std::size_t index, Tally& tally) const {
    int left = kMostParts;
    tally.add(beyond({part.begin(), part.end()}, left) - error_, index);
  }

 private:
  static constexpr int kMostParts = 20'000;

  /// A distance of the part's points that is ≤ error_ if all are.
  double beyond(const Polygon& part, int& left) const {
    Point centre = Point::Zero();
    for (const Point& p : part) centre += p / static_cast<double>(part.size());
    double radius = 0;
    for (const Point& p : part) radius = std::max(radius, (p - centre).norm());
    const auto [distance, triangle] = to_.nearest(centre);
    if (distance > error_ || distance + radius <= error_ || radius <= smallest_) return distance;
    double farthest = 0;
    for (const Point& p : part)
      farthest = std::max(farthest, squared_distance_to_triangle(p, to_.triangles()[triangle]));
    if (std::sqrt(farthest) <= error_) return std::sqrt(farthest);
    if (--left < 0) return distance + radius;
    double worst = 0;
    for (const Polygon& piece : pieces(part, to_.triangles()[triangle])) {
      if (piece.empty()) continue;
      worst = std::max(worst, beyond(piece, left));
      if (worst > error_) break;
    }
    return worst;
  }

  /// The part over the triangle, and those beyond its sides; halves where there is only one.
  static std::vector<Polygon> pieces(const Polygon& part, const CheckCorners& t) {
    const Point normal = (t[1] - t[0]).cross(t[2] - t[0]);
    std::vector<Polygon> pieces;
    Polygon over = part;
    for (std::size_t k = 0; k < 3 && !over.empty(); ++k) {
      const Point out = (t[(k + 1) % 3] - t[k]).cross(normal);
      if (!(out.squaredNorm() > 0)) break;
      auto [behind, ahead] = parts_by(over, t[k], out.normalized());
      if (!ahead.empty()) pieces.push_back(std::move(ahead));
      over = std::move(behind);
    }
    if (!over.empty() && !pieces.empty()) {
      pieces.push_back(std::move(over));
      return pieces;
    }
    auto [first, second] = halves_of(part);
    return {std::move(first), std::move(second)};
  }

  const CheckedMesh& to_;
  double error_, smallest_;
};

Invariant near(const std::string& name, const std::string& of,
               const std::vector<CheckCorners>& triangles, const CheckedMesh& to, double error) {
  const NearProof proof(to, error);
  return tally_all(triangles.size(),
                   [&](std::size_t i, Tally& tally) { proof.prove(triangles[i], i, tally); })
      .named(name, "distance of a point of the " + of + " − the error, unit frame");
}

/// Whether a point of a triangle is between inside and outside, not between shells of the solid.
bool bounds_at(const CheckedMesh& surface, const CheckCorners& triangle, const Point& p) {
  const Point step =
      (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized() * 1e-9;
  return surface.winding(p + step) <= 0 && surface.winding(p - step) >= 1;
}

/// Those triangles that bound the solid as a whole.
std::vector<CheckCorners> boundary(const CheckedMesh& surface) {
  const std::vector<CheckCorners>& all = surface.triangles();
  std::vector<char> bounds(all.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    bounds[i] = bounds_at(surface, all[i], (all[i][0] + all[i][1] + all[i][2]) / 3);
  });
  std::vector<CheckCorners> kept;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (bounds[i] != 0) kept.push_back(all[i]);
  return kept;
}

/// Of triangles of which parts bound the solid those parts are near, by points spread over them:
/// a million at most.
Invariant parts_near(const std::string& name, const CheckedMesh& mesh, const CheckedMesh& kept,
                     double error) {
  constexpr std::size_t kPoints = 1'000'000;
  const std::size_t count = mesh.triangles().size();
  int rows = 1;
  while (rows < 16 && 4 * static_cast<std::size_t>(rows * rows) * count <= kPoints) rows *= 2;
  return tally_all(count,
                   [&](std::size_t i, Tally& tally) {
                     const CheckCorners& t = mesh.triangles()[i];
                     double worst = -error;
                     for (int j = 0; j < rows; ++j)
                       for (int k = 0; j + k < rows; ++k) {
                         const double u = (j + 1.0 / 3) / rows, v = (k + 1.0 / 3) / rows;
                         const Point p = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
                         const double off = kept.distance(p, 2 * error + 1e-9) - error - 1e-11;
                         if (off > worst && (off <= 0 || bounds_at(mesh, t, p))) worst = off;
                       }
                     tally.add(worst, i);
                   })
      .named(name, "distance of a point of the mesh that bounds the solid − the error, unit frame");
}

/// Every ball holds the triangles below it.
Invariant balls(const AssetHeader& asset, const SurfaceHeader& surface,
                const SurfaceTriangles& triangles) {
  Tally sum;
  std::size_t number = 0;
  for (std::uint32_t k = 1; k < surface.level_count; ++k) {
    const std::size_t count = surface.level[k - 1].count;
    sum.add(tally_all(count, [&](std::size_t i, Tally& tally) {
      const BallBlock& block = at<BallBlock>(asset, surface.level[k].blocks)[i / kWidth];
      const Origin& origin = at<Origin>(asset, surface.level[k].origins)[i / kWidth];
      const std::size_t lane = i % kWidth;
      const Point centre(origin.x + block.x[lane], origin.y + block.y[lane],
                         origin.z + block.z[lane]);
      double reach = 0;
      const std::size_t end = std::min(triangles.blocks(), (i + 1) << (4 * (k - 1)));
      for (std::size_t b = i << (4 * (k - 1)); b < end; ++b)
        for (std::uint32_t l = 0; l < triangles.lanes(b); ++l)
          for (const Point& p : triangles.corners(b, l))
            reach = std::max(reach, (p - centre).norm());
      tally.add(reach - double{block.r[lane]}, number + i);
    }));
    number += count;
  }
  return sum.named(
      "surface balls",
      "largest distance of the triangles below from a ball's centre − its radius, unit frame");
}

}  // namespace

std::vector<Invariant> check_near(const std::string& what, const CheckedMesh& kept,
                                  const CheckedMesh& solid, double error, Bounding bounding) {
  const std::string back = "mesh near " + what;
  return {near(what + " near mesh", what, kept.triangles(), solid, error),
          bounding == Bounding::parts ? parts_near(back, solid, kept, error)
                                      : near(back, "mesh", solid.triangles(), kept, error)};
}

CheckedMesh boundary_of(const CheckedMesh& surface, Bounding bounding) {
  return bounding == Bounding::shells ? CheckedMesh(boundary(surface)) : surface;
}

std::vector<Invariant> check_surface(const AssetHeader& asset, const CheckedMesh& mesh,
                                     Bounding bounding) {
  if (asset.surface == 0) return {};
  const SurfaceHeader& surface = *at<SurfaceHeader>(asset, asset.surface);
  const SurfaceTriangles triangles(asset, surface);
  const CheckedMesh of_surface(triangles.all());
  const CheckedMesh solid = boundary_of(mesh, bounding);
  std::vector<Invariant> out = check_near("surface", of_surface, solid, surface.error, bounding);
  out.push_back(closed(of_surface.triangles()));
  if (surface.level_count > 1) out.push_back(balls(asset, surface, triangles));
  append(out, check_surface_cells(asset, surface, of_surface, solid));
  return out;
}

}  // namespace ist
