#include "mesh/level_set/polygonise.h"

#include <ist/types.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>

#include "base/hashing.h"

namespace ist {
namespace {

// The offset of the box in the grid, which avoids planes that are frequent in models.
constexpr double kBoxStart[3] = {1.3819, 1.4142, 1.3028};

}  // namespace

std::uint64_t morton_code(const std::array<std::int32_t, 3>& at) {
  std::uint64_t code = 0;
  for (std::size_t k = 0; k < 3; ++k) code |= spread_bits(static_cast<std::uint64_t>(at[k])) << k;
  return code;
}

void find_loops(SurfaceCell& cell) {
  std::array<int, 12> next{};  // a forest: the loop's smallest edge is the root
  for (int e = 0; e < 12; ++e) next[static_cast<std::size_t>(e)] = e;
  const auto root = [&](int e) {
    while (next[static_cast<std::size_t>(e)] != e) e = next[static_cast<std::size_t>(e)];
    return e;
  };
  const auto unite = [&](int a, int b) {
    a = root(a);
    b = root(b);
    next[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      // The face's edges: along u at both ends of v, along v at both ends of u.
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      int crossed[4], count = 0;
      for (int end = 0; end < 2; ++end) {
        // Edge 4u + bits: bit 0 is the coordinate along v, bit 1 that along axis; and so on.
        const int along_u = 4 * u + end + 2 * side, along_v = 4 * v + side + 2 * end;
        if (cell.crosses(along_u)) crossed[count++] = along_u;
        if (cell.crosses(along_v)) crossed[count++] = along_v;
      }
      if (count == 2) unite(crossed[0], crossed[1]);
      if (count < 4) continue;
      for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j)
          for (const int a : edge_corners(crossed[i]))
            for (const int b : edge_corners(crossed[j]))
              if (a == b && (cell.inside >> a & 1) != 0) unite(crossed[i], crossed[j]);
    }
  std::array<std::uint8_t, 12> number{};
  for (int e = 0; e < 12; ++e) {
    if (!cell.crosses(e)) continue;
    const auto r = static_cast<std::size_t>(root(e));
    if (r == static_cast<std::size_t>(e)) number[r] = cell.loops++;
    cell.loop_of[static_cast<std::size_t>(e)] = number[r];
  }
}

double CellGrid::rounding() const {
  double far = 0;
  for (int k = 0; k < 3; ++k)
    far = std::max(far, std::abs(low[k]) + edge * count[static_cast<std::size_t>(k)]);
  return 0x1p-48 * far;
}

std::array<int, 2> edge_corners(int edge) {
  const int axis = edge / 4, bits = edge % 4;
  const int low = (bits & 1) << (axis + 1) % 3 | (bits >> 1) << (axis + 2) % 3;
  return {low, low | 1 << axis};
}

bool SurfaceCell::crosses(int edge) const {
  const auto [a, b] = edge_corners(edge);
  return ((inside >> a ^ inside >> b) & 1) != 0;
}

CellGrid grid_around(const Solid& solid, unsigned cells) {
  const Eigen::AlignedBox3d box = solid.bounds();
  unit_frame(box);  // throws if there is no box
  CellGrid grid;
  grid.edge = 2 * ((box.max() / 2 - box.min() / 2).maxCoeff() / cells);
  for (int k = 0; k < 3; ++k) {
    grid.low[k] = box.min()[k] - kBoxStart[k] * grid.edge;
    const double across = (box.max()[k] - grid.low[k]) / grid.edge;
    grid.count[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(across) + 2;
  }
  return grid;
}

std::vector<SurfaceCell> find_surface_cells(const Solid& solid, const CellGrid& grid,
                                            const std::function<void(int, int)>& report) {
  int levels = 0;
  while (1 << levels < *std::max_element(grid.count.begin(), grid.count.end())) ++levels;
  const double slack = grid.rounding();
  std::vector<SurfaceCell> cells(1);
  for (int level = 1; level <= levels; ++level) {
    report(level, levels);
    const int width = 1 << (levels - level);  // of a child, in cells of the grid
    const double reach = width * grid.half_diagonal() * (1 + 1e-12) + slack;
    std::vector<std::uint8_t> kept(cells.size(), 0);  // bit i: child i
    tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t c) {
      for (int i = 0; i < 8; ++i) {
        double middle[3];
        bool within = true;
        for (std::size_t k = 0; k < 3; ++k) {
          const int first = (2 * cells[c].at[k] + (i >> k & 1)) * width;
          within = within && first < grid.count[k];
          middle[k] = first + 0.5 * width;
        }
        if (!within) continue;
        const double distance = solid.signed_distance(grid.point(middle[0], middle[1], middle[2]));
        // NaN is kept, and detected when signs are computed.
        if (!(std::abs(distance) > reach)) kept[c] = static_cast<std::uint8_t>(kept[c] | 1 << i);
      }
    });
    std::vector<SurfaceCell> children;
    for (std::size_t c = 0; c < cells.size(); ++c)
      for (int i = 0; i < 8; ++i) {
        if ((kept[c] >> i & 1) == 0) continue;
        SurfaceCell child;
        child.key = 8 * cells[c].key + static_cast<std::uint64_t>(i);
        for (std::size_t k = 0; k < 3; ++k) child.at[k] = 2 * cells[c].at[k] + (i >> k & 1);
        children.push_back(child);
      }
    cells = std::move(children);
  }
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t c) {
    SurfaceCell& cell = cells[c];
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner =
          grid.point(cell.at[0] + (i & 1), cell.at[1] + (i >> 1 & 1), cell.at[2] + (i >> 2));
      const double distance = solid.signed_distance(corner);
      if (std::isnan(distance))
        throw Error("solid: its signed distance is NaN at a point within its bounds");
      if (distance < 0) cell.inside = static_cast<std::uint8_t>(cell.inside | 1 << i);
    }
    find_loops(cell);
  });
  return cells;
}

const SurfaceCell* cell_at(const std::vector<SurfaceCell>& cells,
                           const std::array<std::int32_t, 3>& at) {
  if (at[0] < 0 || at[1] < 0 || at[2] < 0) return nullptr;
  const std::uint64_t key = morton_code(at);
  const auto found =
      std::lower_bound(cells.begin(), cells.end(), key,
                       [](const SurfaceCell& c, std::uint64_t k) { return c.key < k; });
  return found != cells.end() && found->key == key ? &*found : nullptr;
}

}  // namespace ist
