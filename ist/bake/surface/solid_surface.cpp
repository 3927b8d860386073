#include "bake/surface/solid_surface.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"
#include "mesh/exact_triangle.h"
#include "mesh/self_intersections.h"
#include "mesh/surface_reduction.h"
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
    const auto [a, b, c] = triangle_corners(mesh, t);
    area[t] = (b - a).cross(c - a).squaredNorm();
  });
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    std::uint32_t& largest = groups.representative[groups.of_triangle[t]];
    if (area[t] >= 0 && (largest == kNoTriangle || area[t] > area[largest])) largest = t;
  }
  return groups;
}

/// The winding number just outside a part of a triangle, where its normal points to; nothing where
/// no point close to its middle is found that is nearer to the triangle than to all others.
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

/// The winding number just outside every triangle, where it is known; nothing of those `apart`.
/// [triangle] `apart`: 1 for those that meet others elsewhere than in shared corners and sides: all
/// of them.
std::vector<std::optional<int>> windings_outside(const MeshSolid& solid,
                                                 const std::vector<std::uint8_t>& apart) {
  const MeshView& mesh = solid.arrays();
  Groups groups;
  tbb::parallel_invoke([&] { groups = find_groups(mesh, apart); }, [&] { solid.view(); });
  std::vector<std::optional<int>> outside(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    const std::uint32_t of = groups.representative[t];
    if (of != kNoTriangle && apart[of] == 0)
      outside[t] = winding_outside(solid, of, triangle_corners(mesh, of));
  });
  // Groups are named by their first triangle.
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    const std::uint32_t first = groups.of_triangle[t];
    if (first != t) outside[t] = outside[first];
  });
  return outside;
}

/// What of a mesh that meets itself is not the boundary of its solid.
struct Overlaps {
  enum class Part : std::uint8_t {
    boundary,  ///< between winding numbers 0 and 1, all of it
    inner,     ///< none of it
    mixed      ///< it meets another triangle: perhaps in parts
  };
  std::vector<Part> part;                           ///< [triangle]
  std::vector<std::array<std::uint32_t, 2>> pairs;  ///< that meet, sorted
  /// Unit frame: every triangle lies within it of the solid's boundary, and where the winding
  /// number is neither 0 nor 1, a triangle is as near. Infinite where that is not known.
  ///
  /// Such points are in bounded regions whose sides are of triangles that are no boundary. Each
  /// region lies in the hull of triangles that hang together, so that from its points a side is no
  /// further than half the hull's width, in any direction. The triangles reach the boundary where
  /// they share a corner with it.
  double off = 0;
};

using Part = Overlaps::Part;
using Point = Eigen::Vector3d;

double side_length(const MeshView& mesh, std::uint32_t a, std::uint32_t b) {
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
        const double there = way[from] + side_length(mesh, from, to);
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
      least = std::min(least, way[c[k]] + std::max(side_length(mesh, c[k], c[(k + 1) % 3]),
                                                   side_length(mesh, c[k], c[(k + 2) % 3])));
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
    for (const Point& p : triangle_corners(mesh, t)) clusters[sets.find(corner(t, 0))].push_back(p);
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

/// Nothing where the meeting triangles are not found in reasonable time.
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

}  // namespace

std::optional<SolidSurface> SolidSurface::of(const MeshSolid& solid, double enough) {
  if (!solid.may_overlap()) {
    SolidSurface surface(solid);
    surface.off_ = solid.moved() - solid.rounding();
    return surface;
  }
  if (!solid.meets_itself()) return of_shells(solid);
  const std::optional<Overlaps> overlaps = find_overlaps(solid);
  if (!overlaps || overlaps->off > enough) return std::nullopt;
  SolidSurface surface(solid);
  surface.off_ = overlaps->off;
  return surface;
}

// A shell of which one side is solid already, or both sides are not yet, is no boundary.
std::optional<SolidSurface> SolidSurface::of_shells(const MeshSolid& solid) {
  SolidSurface surface(solid);
  const MeshView& mesh = solid.arrays();
  const std::vector<std::optional<int>> outside =
      windings_outside(solid, std::vector<std::uint8_t>(mesh.triangle_count));
  std::vector<std::uint32_t>& kept = surface.triangles_;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    if (!outside[t]) return std::nullopt;
    if (*outside[t] == 0)
      kept.insert(kept.end(), mesh.triangles + 3 * t, mesh.triangles + 3 * t + 3);
  }
  if (kept.empty()) return std::nullopt;
  surface.arrays_.triangle_count = static_cast<std::uint32_t>(kept.size() / 3);
  if (surface.arrays_.triangle_count == mesh.triangle_count) kept.clear();
  if (!kept.empty()) surface.arrays_.triangles = kept.data();
  return surface;
}

const MeshView& SolidSurface::view() {
  if (triangles_.empty()) return solid_->view();
  if (!hierarchy_) {
    hierarchy_ = build_bvh({arrays_.vertices, 3 * std::size_t{arrays_.vertex_count}}, triangles_);
    view_ = arrays_;
    view_.nodes = hierarchy_->nodes.get();
    view_.blocks = hierarchy_->blocks.get();
    view_.root = hierarchy_->root;
  }
  return view_;
}

}  // namespace ist
