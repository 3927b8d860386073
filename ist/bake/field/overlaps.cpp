#include "bake/field/overlaps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "bake/field/winding_sides.h"
#include "mesh/disjoint_sets.h"
#include "mesh/exact_triangle.h"
#include "mesh/self_intersections.h"
#include "mesh/surface_reduction.h"

namespace ist {
namespace {

using Part = Overlaps::Part;
using Point = Eigen::Vector3d;

double between(const MeshView& mesh, std::uint32_t a, std::uint32_t b) {
  return (Eigen::Map<const Point>(mesh.vertices + 3 * std::size_t{a}) -
          Eigen::Map<const Point>(mesh.vertices + 3 * std::size_t{b}))
      .norm();
}

/// How far a point of a triangle that is no boundary may be from it: along sides of such triangles
/// to a corner that they share with it. Infinite where there is no such way.
double farthest_from_boundary(const MeshView& mesh, const Overlaps& overlaps,
                              const std::vector<std::uint32_t>& others) {
  std::vector<double> way(mesh.vertex_count, HUGE_VAL);
  tbb::parallel_for(std::size_t{0}, overlaps.part.size(), [&](const std::size_t t) {
    if (overlaps.part[t] == Part::boundary)
      for (std::size_t k = 0; k < 3; ++k)
        std::atomic_ref(way[mesh.triangles[3 * t + k]]).store(0, std::memory_order_relaxed);
  });
  for (bool shorter = true; shorter;) {
    shorter = false;
    for (const std::uint32_t t : others)
      for (std::size_t k = 0; k < 9; ++k) {
        const std::uint32_t from = mesh.triangles[3 * std::size_t{t} + k / 3];
        const std::uint32_t to = mesh.triangles[3 * std::size_t{t} + k % 3];
        const double there = way[from] + between(mesh, from, to);
        if (!(there < way[to])) continue;
        way[to] = there;
        shorter = true;
      }
  }
  double most = 0;
  for (const std::uint32_t t : others) {
    const std::uint32_t* c = mesh.triangles + 3 * std::size_t{t};
    double least = HUGE_VAL;
    for (int k = 0; k < 3; ++k)
      least = std::min(least, way[c[k]] + std::max(between(mesh, c[k], c[(k + 1) % 3]),
                                                   between(mesh, c[k], c[(k + 2) % 3])));
    most = std::max(most, least);
  }
  return most;
}

/// The least width found of a set of points, in directions of whole numbers.
double width(const std::vector<Point>& points) {
  constexpr int kMost = 4;
  double least = HUGE_VAL;
  for (int x = -kMost; x <= kMost; ++x)
    for (int y = -kMost; y <= kMost; ++y)
      for (int z = 0; z <= kMost; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (const Point& p : points) {
          const double at = p[0] * x + p[1] * y + p[2] * z;
          low = std::min(low, at);
          high = std::max(high, at);
        }
        least = std::min(least, (high - low) / std::sqrt(x * x + y * y + z * z));
      }
  return least;
}

/// Half the largest width of triangles that are no boundary and hang together, by corners or where
/// they meet.
double half_width(const MeshView& mesh, const Overlaps& overlaps,
                  const std::vector<std::uint32_t>& others) {
  DisjointSets sets(mesh.vertex_count);
  const auto corner = [&](std::uint32_t t, std::size_t k) {
    return mesh.triangles[3 * std::size_t{t} + k];
  };
  for (const std::uint32_t t : others)
    for (std::size_t k = 1; k < 3; ++k) sets.unite(corner(t, 0), corner(t, k));
  for (const auto& [a, b] : overlaps.pairs) sets.unite(corner(a, 0), corner(b, 0));
  std::map<std::uint32_t, std::vector<Point>> clusters;
  for (const std::uint32_t t : others)
    for (const Point& p : corners_in(mesh, t)) clusters[sets.find(corner(t, 0))].push_back(p);
  double most = 0;
  for (const auto& [name, points] : clusters) most = std::max(most, width(points) / 2);
  return most;
}

double off_boundary(const MeshView& mesh, const Overlaps& overlaps) {
  std::vector<std::uint32_t> others;
  for (std::uint32_t t = 0; t < overlaps.part.size(); ++t)
    if (overlaps.part[t] != Part::boundary) others.push_back(t);
  return std::max(farthest_from_boundary(mesh, overlaps, others),
                  half_width(mesh, overlaps, others)) *
         (1 + 1e-12);
}

std::optional<SelfIntersections> self_intersections(const MeshView& mesh) {
  std::vector<Point> vertices(mesh.vertex_count);
  tbb::parallel_for(std::size_t{0}, vertices.size(), [&](const std::size_t v) {
    vertices[v] = Eigen::Map<const Point>(mesh.vertices + 3 * v);
  });
  std::vector<Triangle> triangles(mesh.triangle_count);
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](const std::size_t t) {
    std::copy_n(mesh.triangles + 3 * t, 3, triangles[t].begin());
  });
  return find_self_intersections(vertices, triangles);
}

}  // namespace

std::optional<Overlaps> find_overlaps(const MeshSolid& solid) {
  const MeshView& mesh = solid.arrays();
  Overlaps out;
  if (solid.meeting_pairs() != nullptr) {
    out.pairs = *solid.meeting_pairs();
  } else {
    auto found = self_intersections(mesh);
    if (!found || !found->pairs) return std::nullopt;
    out.pairs = *std::move(found->pairs);
  }
  std::vector<std::uint8_t> apart(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](const std::uint32_t t) {
    const Corners at = corners_of(mesh, t);  // of equal corners too
    apart[t] = is_on_a_line(at.p[0], at.p[1], at.p[2]) ? 1 : 0;
  });
  for (const auto& [a, b] : out.pairs) apart[a] = apart[b] = 1;
  const std::vector<std::optional<int>> outside = windings_outside(solid, apart);
  out.part.resize(mesh.triangle_count);
  tbb::parallel_for(std::size_t{0}, out.part.size(), [&](const std::size_t t) {
    out.part[t] = !outside[t] ? Part::mixed : *outside[t] == 0 ? Part::boundary : Part::inner;
  });
  out.off = off_boundary(mesh, out);
  return out;
}

}  // namespace ist
