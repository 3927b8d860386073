#include "mesh/orient_soup.h"

#include <array>
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

/// Fronts less backs that are seen of each patch along one axis; corners are `points`, unit frame,
/// with that axis first.
void look_along(const std::vector<std::array<double, 3>>& points,
                const std::vector<Triangle>& triangles, DisjointSets& patches,
                std::vector<std::int64_t>& votes) {
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
      if (seen.triangle != kNoIndex) votes[patches.find(seen.triangle)] += seen.front ? 1 : -1;
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
  std::vector<std::int64_t> votes(soup.triangles.size(), 0);
  std::vector<std::array<double, 3>> points(soup.vertices.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t v = 0; v < points.size(); ++v) {
      const Eigen::Vector3d x = frame.to_unit(soup.vertices[v]);
      points[v] = {x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3]};
    }
    look_along(points, soup.triangles, patches, votes);
  }
  std::int64_t majority = 0;
  for (const std::int64_t vote : votes) majority += vote;
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    const std::int64_t vote = votes[patches.find(t)];
    if (vote < 0 || (vote == 0 && majority < 0))
      std::swap(soup.triangles[t][1], soup.triangles[t][2]);
  }
}

}  // namespace ist
