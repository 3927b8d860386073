#include "mesh/orient_soup.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <ist/solid.h>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"
#include "mesh/line_lattice.h"
#include "mesh/shells.h"

namespace ist {
namespace {

constexpr std::uint32_t kLines = 200;  ///< of sight, along each side of a view

/// What is seen first along a line, from one of its ends.
struct Seen {
  double x = std::numeric_limits<double>::infinity();  ///< distance along the line
  std::uint32_t triangle = kNoIndex;
  bool front = false;

  void offer(const Seen& other) {
    if (other.x < x) *this = other;
  }
};

/// Lines of sight that end on a patch.
struct Votes {
  std::int64_t fronts = 0, backs = 0;
};

/// Adds what is seen of each patch along one axis; corners are `points`, unit frame, with that axis
/// first.
void look_along(const std::vector<std::array<double, 3>>& points,
                const std::vector<Triangle>& triangles, DisjointSets& patches,
                std::vector<Votes>& votes) {
  LineLattice lattice;
  lattice.y0 = lattice.z0 = -1;
  lattice.step_y = lattice.step_z = 2.0 / kLines;
  lattice.offset = kGoldenRatio;
  lattice.ny = lattice.nz = kLines;
  std::vector<Seen> low(lattice.lines()), high(lattice.lines());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) { return points[triangles[t][k]].data(); };
    const Corners corners = {{corner(0), corner(1), corner(2)}};
    const LatticeRange rows = rows_of(lattice, corners);
    for (std::uint32_t j = rows.first; j < rows.last; ++j) {
      const LatticeRange lines = lines_of(lattice, corners, j);
      for (std::uint32_t i = lines.first; i < lines.last; ++i) {
        const Crossing crossing = crossing_of(lattice, corners, i, j);
        if (crossing.sign == 0) continue;
        const std::size_t line = std::size_t{j} * lattice.ny + i;
        low[line].offer({crossing.x, t, crossing.sign > 0});
        high[line].offer({-crossing.x, t, crossing.sign < 0});
      }
    }
  }
  for (const std::vector<Seen>* const end : {&low, &high})
    for (const Seen& seen : *end)
      if (seen.triangle != kNoIndex) {
        Votes& patch = votes[patches.find(seen.triangle)];
        ++(seen.front ? patch.fronts : patch.backs);
      }
}

/// For each patch the volume between it and the middle of its area: > 0 where it bulges to its
/// front. 0 where only rounding is left, as of a flat one.
std::vector<double> bulges(const TriangleMesh& soup, DisjointSets& patches,
                           const UnitFrame& frame) {
  struct Sum {
    double area = 0, volume = 0, magnitude = 0;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  };
  std::vector<Sum> sums(soup.triangles.size());
  const auto corner = [&](std::uint32_t t, std::size_t k) {
    return frame.to_unit(soup.vertices[soup.triangles[t][k]]);
  };
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    const Eigen::Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    const double area = (b - a).cross(c - a).norm();
    Sum& sum = sums[patches.find(t)];
    sum.area += area;
    sum.middle += area / 3 * (a + b + c);
  }
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    Sum& sum = sums[patches.find(t)];
    if (!(sum.area > 0)) continue;
    const Eigen::Vector3d middle = sum.middle / sum.area;
    const Eigen::Vector3d a = corner(t, 0) - middle, b = corner(t, 1) - middle,
                          c = corner(t, 2) - middle;
    const double volume = a.dot(b.cross(c));
    sum.volume += volume;
    sum.magnitude += a.norm() * b.cross(c).norm();
  }
  constexpr double kRounding = 1e-9;
  std::vector<double> result(sums.size());
  for (std::size_t p = 0; p < sums.size(); ++p)
    result[p] = std::abs(sums[p].volume) > kRounding * sums[p].magnitude ? sums[p].volume : 0;
  return result;
}

}  // namespace

void orient_soup(TriangleMesh& soup) {
  const EdgeTable edges(soup.triangles);
  make_consistent(soup.triangles, manifold_partners(edges));
  DisjointSets patches = manifold_patches(soup.triangles, edges);
  Eigen::AlignedBox3d bounds;
  for (const Triangle& t : soup.triangles)
    for (const std::uint32_t v : t) bounds.extend(soup.vertices[v]);
  const UnitFrame frame = unit_frame(bounds);
  std::vector<Votes> votes(soup.triangles.size());
  std::vector<std::array<double, 3>> points(soup.vertices.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t v = 0; v < points.size(); ++v) {
      const Eigen::Vector3d x = frame.to_unit(soup.vertices[v]);
      points[v] = {x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3]};
    }
    look_along(points, soup.triangles, patches, votes);
  }
  const std::vector<double> bulge = bulges(soup, patches, frame);
  // Lines by which a patch shows its front more than its back, or as it bulges.
  const auto in_favour = [&](std::uint32_t patch) {
    const auto [fronts, backs] = votes[patch];
    if (fronts > 2 * backs || backs > 2 * fronts || bulge[patch] == 0) return fronts - backs;
    return bulge[patch] > 0 ? fronts + backs : -(fronts + backs);
  };
  std::int64_t majority = 0;
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t)
    if (patches.find(t) == t) majority += in_favour(t);
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    const std::int64_t favour = in_favour(patches.find(t));
    if (favour < 0 || (favour == 0 && majority < 0))
      std::swap(soup.triangles[t][1], soup.triangles[t][2]);
  }
}

}  // namespace ist
