#include "bake/field/winding_sides.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <cmath>
#include <cstddef>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"
#include "stage/raw_array.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;

/// Triangles that hang together across edges of two sides, those `apart` by themselves. Where they
/// meet no others, the winding number on either side of such a group is the same everywhere.
struct Groups {
  std::vector<std::uint32_t> of_triangle;     ///< named by its first triangle
  std::vector<std::uint32_t> representative;  ///< [group] a triangle of largest area
};

Groups find_groups(const MeshView& mesh, const std::vector<std::uint8_t>& apart) {
  RawArray<Triangle> triangles(mesh.triangle_count);
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
    triangles[t] = {mesh.triangles[3 * t], mesh.triangles[3 * t + 1], mesh.triangles[3 * t + 2]};
  });
  const EdgeTable edges(triangles);
  DisjointSets sets(triangles.size());
  tbb::parallel_for(std::size_t{0}, edges.size(), [&](const std::size_t e) {
    if (const auto sides = edges.sides(e);
        sides.size() == 2 && apart[sides[0] / 3] == 0 && apart[sides[1] / 3] == 0)
      sets.unite(sides[0] / 3, sides[1] / 3);
  });
  Groups groups;
  groups.of_triangle.resize(triangles.size());
  groups.representative.resize(triangles.size(), kNoTriangle);
  RawArray<double> area(triangles.size());
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    groups.of_triangle[t] = sets.find(t);
    const auto [a, b, c] = corners_in(mesh, t);
    area[t] = (b - a).cross(c - a).squaredNorm();
  });
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    std::uint32_t& largest = groups.representative[groups.of_triangle[t]];
    if (area[t] >= 0 && (largest == kNoTriangle || area[t] > area[largest])) largest = t;
  }
  return groups;
}

}  // namespace

std::array<Eigen::Vector3d, 3> corners_in(const MeshView& mesh, std::uint32_t triangle) {
  std::array<Point, 3> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = Eigen::Map<const Point>(
        mesh.vertices + 3 * std::size_t{mesh.triangles[3 * std::size_t{triangle} + k]});
  return corners;
}

std::optional<int> winding_outside(const MeshSolid& solid, std::uint32_t triangle,
                                   const std::array<Eigen::Vector3d, 3>& part) {
  const auto& [a, b, c] = part;
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

std::vector<std::optional<int>> windings_outside(const MeshSolid& solid,
                                                 const std::vector<std::uint8_t>& apart) {
  const MeshView& mesh = solid.arrays();
  Groups groups;
  tbb::parallel_invoke([&] { groups = find_groups(mesh, apart); }, [&] { solid.view(); });
  std::vector<std::optional<int>> outside(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    const std::uint32_t of = groups.representative[t];
    if (of != kNoTriangle && apart[of] == 0)
      outside[t] = winding_outside(solid, of, corners_in(mesh, of));
  });
  // Groups are named by their first triangle.
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    const std::uint32_t first = groups.of_triangle[t];
    if (first != t) outside[t] = outside[first];
  });
  return outside;
}

}  // namespace ist
