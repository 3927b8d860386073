#include "bake/field/solid_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;

std::array<Point, 3> corners_of(const MeshView& mesh, std::uint32_t triangle) {
  std::array<Point, 3> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = Eigen::Map<const Point>(
        mesh.vertices + 3 * std::size_t{mesh.triangles[3 * std::size_t{triangle} + k]});
  return corners;
}

/// Triangles that hang together across edges of two sides. Without intersections the winding number
/// on either side of such a group is the same everywhere.
struct Groups {
  std::vector<std::uint32_t> of_triangle;     ///< named by its first triangle
  std::vector<std::uint32_t> representative;  ///< [group] a triangle of largest area
};

Groups find_groups(const MeshView& mesh) {
  std::vector<Triangle> triangles(mesh.triangle_count);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    triangles[t] = {mesh.triangles[3 * t], mesh.triangles[3 * t + 1], mesh.triangles[3 * t + 2]};
  const EdgeTable edges(triangles);
  DisjointSets sets(triangles.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (const auto sides = edges.sides(e); sides.size() == 2)
      sets.unite(sides[0] / 3, sides[1] / 3);
  Groups groups;
  groups.of_triangle.resize(triangles.size());
  groups.representative.resize(triangles.size(), kNoTriangle);
  std::vector<double> largest(triangles.size(), -1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t group = groups.of_triangle[t] = sets.find(t);
    const auto [a, b, c] = corners_of(mesh, t);
    const double area = (b - a).cross(c - a).squaredNorm();
    if (area > largest[group]) {
      largest[group] = area;
      groups.representative[group] = t;
    }
  }
  return groups;
}

/// The winding number just outside a triangle; nothing where no point close to it is found that
/// is nearer to it than to all others.
std::optional<int> winding_outside(const MeshSolid& solid, std::uint32_t triangle) {
  const auto [a, b, c] = corners_of(solid.arrays(), triangle);
  const Point normal = (b - a).cross(c - a);
  const double length = std::sqrt(normal.squaredNorm());
  if (!(length > 0)) return std::nullopt;
  const Point middle = (a + b + c) / 3;
  for (double away = 0x1p-8; away > 0x1p-44; away /= 4) {
    const Point p = middle + normal * (away / length);
    if (solid.closest_point(p).triangle == triangle) return solid.winding_number(p);
  }
  return std::nullopt;
}

}  // namespace

std::optional<SolidSurface> SolidSurface::of(const MeshSolid& solid) {
  if (solid.meets_itself()) return std::nullopt;
  SolidSurface surface(solid);
  if (!solid.may_overlap()) return surface;
  // A shell of which one side is solid already, or both sides are not yet, is no boundary.
  const MeshView& mesh = solid.arrays();
  const Groups groups = find_groups(mesh);
  std::vector<std::optional<int>> outside(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    if (groups.representative[t] != kNoTriangle)
      outside[t] = winding_outside(solid, groups.representative[t]);
  });
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    const std::optional<int> winding = outside[groups.of_triangle[t]];
    if (!winding) return std::nullopt;
    if (*winding == 0)
      surface.kept_.insert(surface.kept_.end(), mesh.triangles + 3 * std::size_t{t},
                           mesh.triangles + 3 * std::size_t{t} + 3);
  }
  if (surface.kept_.empty()) return std::nullopt;
  surface.arrays_.triangle_count = static_cast<std::uint32_t>(surface.kept_.size() / 3);
  if (surface.arrays_.triangle_count == mesh.triangle_count) surface.kept_.clear();
  if (!surface.kept_.empty()) surface.arrays_.triangles = surface.kept_.data();
  return surface;
}

const MeshView& SolidSurface::view() {
  if (kept_.empty()) return solid_->view();
  if (!hierarchy_) {
    const std::vector<double> vertices(arrays_.vertices,
                                       arrays_.vertices + 3 * std::size_t{arrays_.vertex_count});
    hierarchy_ = build_bvh(vertices, kept_);
    view_ = arrays_;
    view_.nodes = hierarchy_->nodes.data();
    view_.blocks = hierarchy_->blocks.data();
    view_.root = hierarchy_->root;
  }
  return view_;
}

}  // namespace ist
