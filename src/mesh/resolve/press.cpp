#include "mesh/resolve/press.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/item_groups.h"
#include "mesh/connectivity/self_intersections.h"
#include "mesh/connectivity/surface_reduction.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/connectivity/weld.h"
#include "mesh/geometry/exact_sign.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;
using Polygon = std::vector<Point>;  ///< convex

/// In near distances: the least size of a face that touches another, and of the touching part.
constexpr double kNarrowest = 16;

class Faces {
 public:
  Faces(const TriangleMesh& mesh, double near)
      : mesh_(mesh), near_(near), normals_(mesh.triangles.size(), Point::Zero()) {
    tbb::parallel_for(std::size_t{0}, normals_.size(), [&](std::size_t t) {
      const auto [a, b, c] = corners(t);
      const Point normal = (b - a).cross(c - a);
      const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
      if (normal.norm() > kNarrowest * near * longest) normals_[t] = normal.normalized();
    });
  }

  /// Zero for needles.
  const Point& normal(std::size_t t) const { return normals_[t]; }

  /// True if two triangles touch face to face.
  bool touch(std::size_t a, std::size_t b) const {
    if (!(normals_[a].dot(normals_[b]) < -0.9)) return false;
    const auto of = corners(a), over = corners(b);
    Polygon common(over.begin(), over.end());
    for (std::size_t k = 0; k < 3 && common.size() >= 3; ++k)
      common = left_of(common, of[k], normals_[a].cross(of[(k + 1) % 3] - of[k]));
    if (common.size() < 3) return false;
    double around = 0;
    Point area = Point::Zero();
    for (std::size_t k = 0; k < common.size(); ++k) {
      const Point &p = common[k], &q = common[(k + 1) % common.size()];
      if (!(std::abs(normals_[a].dot(p - of[0])) <= near_)) return false;
      around += (q - p).norm();
      area += (p - common[0]).cross(q - common[0]) / 2;
    }
    return area.norm() > kNarrowest * near_ * around;
  }

  /// True if they lie in one plane exactly.
  bool coplanar(std::size_t a, std::size_t b) const {
    const auto of = corners(a), over = corners(b);
    return std::all_of(over.begin(), over.end(), [&](const Point& p) {
      return orient3d_sign(of[0].data(), of[1].data(), of[2].data(), p.data()) == 0;
    });
  }

 private:
  std::array<Point, 3> corners(std::size_t t) const {
    const Triangle& of = mesh_.triangles[t];
    return {mesh_.vertices[of[0]], mesh_.vertices[of[1]], mesh_.vertices[of[2]]};
  }

  static Polygon left_of(const Polygon& polygon, const Point& on, const Point& inward) {
    Polygon left;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Point &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
      const double from = inward.dot(p - on), to = inward.dot(q - on);
      if (from >= 0) left.push_back(p);
      if ((from < 0 && to > 0) || (from > 0 && to < 0))
        left.push_back(p + from / (from - to) * (q - p));
    }
    return left;
  }

  const TriangleMesh& mesh_;
  double near_;
  std::vector<Point> normals_;
};

/// Nearly the shortest displacement that moves one step along each normal; limited at knife-sharp
/// edges. Zero if faces on both sides share the vertex.
Point displacement_along(const std::vector<Point>& normals) {
  constexpr double kFarthest = 8;
  constexpr int kRounds = 64;
  Point displacement = Point::Zero();
  for (int round = 0; round < kRounds; ++round) {
    double missing = 0;
    for (const Point& n : normals) {
      const double short_of = 1 - n.dot(displacement);
      if (short_of > 0) displacement += short_of * n;
      missing = std::max(missing, short_of);
    }
    if (missing < 1e-3) break;
  }
  if (displacement.norm() > kFarthest) displacement *= kFarthest / displacement.norm();
  const bool is_valid = std::all_of(normals.begin(), normals.end(),
                                    [&](const Point& n) { return n.dot(displacement) > 0.05; });
  return is_valid ? displacement : Point(Point::Zero());
}

using Pairs = std::vector<std::array<std::uint32_t, 2>>;

/// [vertex] True at touching faces, if some of the connected faces touch inexactly.
std::vector<bool> touching_vertices(const TriangleMesh& mesh, const Faces& faces,
                                    const Pairs& touching) {
  DisjointSets together(mesh.vertices.size());
  std::vector<bool> inexact(mesh.vertices.size(), false), chosen(mesh.vertices.size(), false);
  for (const auto& pair : touching)
    for (const std::uint32_t t : pair)
      for (const std::uint32_t v : mesh.triangles[t]) together.unite(mesh.triangles[pair[0]][0], v);
  for (const auto& [a, b] : touching)
    if (!faces.coplanar(a, b)) inexact[together.find(mesh.triangles[a][0])] = true;
  for (const auto& pair : touching)
    for (const std::uint32_t t : pair)
      for (const std::uint32_t v : mesh.triangles[t]) chosen[v] = inexact[together.find(v)];
  return chosen;
}

}  // namespace

Pressed press_together(const TriangleMesh& mesh) {
  Pressed pressed;
  const double near = kNearSteps * spacing_at(largest_coordinate(bounds_of(mesh.vertices)));
  const auto find_touching = [&](const TriangleMesh& of, const Faces& faces) {
    return find_pairs(of.vertices, of.triangles, near,
                      [&](std::uint32_t a, std::uint32_t b) { return faces.touch(a, b); })
        .value_or(Pairs());
  };
  const Faces as_they_came(mesh, near);
  const Pairs touching = find_touching(mesh, as_they_came);
  const std::vector<bool> chosen = touching_vertices(mesh, as_they_came, touching);
  if (std::find(chosen.begin(), chosen.end(), true) == chosen.end()) return pressed;

  pressed.mesh = weld_among(mesh, near, chosen);
  std::vector<Triangle>& triangles = pressed.mesh.triangles;
  std::erase_if(triangles, has_repeated_corner);
  reduce_coincident(triangles, EdgeTable(triangles));
  const Faces faces(pressed.mesh, near);
  const Pairs left = find_touching(pressed.mesh, faces);
  const std::vector<bool> inexact = touching_vertices(pressed.mesh, faces, left);
  const ItemGroups<> touched(inexact.size(), [&](const auto& visit) {
    for (const auto& pair : left)
      for (const std::uint32_t t : pair)
        for (const std::uint32_t v : triangles[t])
          if (inexact[v]) visit(v, t);
  });
  pressed.vertices = pressed.mesh.vertices;
  std::vector<Point> normals;
  for (std::uint32_t v = 0; v < inexact.size(); ++v) {
    if (touched[v].empty()) continue;
    normals.clear();
    for (const std::uint32_t t : touched[v]) normals.push_back(faces.normal(t));
    pressed.vertices[v] += near * displacement_along(normals);
    pressed.moved =
        std::max(pressed.moved, (pressed.vertices[v] - pressed.mesh.vertices[v]).norm());
  }
  pressed.apart = 2 * pressed.moved + near;
  pressed.moved = (pressed.moved + near) * (1 + 1e-15);
  return pressed;
}

}  // namespace ist
