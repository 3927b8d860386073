#include "bake/field/sign_grid.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <ist/error.h>

#include "bake/field/cell_overlap.h"
#include "bake/field/surface_area.h"
#include "mesh/winding.h"

namespace ist {
namespace {

constexpr double kMargin = 0.0625;    // of a cell, from the lowest corner of the surface
constexpr double kNearest = 1e-9;     // of a cell: reference points keep away from triangles
constexpr double kAnother = 1.00391;  // of a cell whose reference points do not
constexpr int kTries = 1000;
/// Cells are taken to be larger by this where triangles are looked for: of a cell, and of the unit
/// frame. A query may round coordinates to float.
constexpr double kEnlarged = 0x1p-10, kEnlargedBy = 0x1p-21;

struct TriangleCorners {
  double p[3][3];
};

TriangleCorners corners_of(const SurfaceBlock& block, std::uint32_t lane) {
  TriangleCorners out;
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t v = block.corner[i][lane];
    out.p[i][0] = block.x[v];
    out.p[i][1] = block.y[v];
    out.p[i][2] = block.z[v];
  }
  return out;
}

/// Cubes of cells, four along an edge, over the bounds of the surface.
struct Grid {
  double low[3], cell;
  std::uint32_t bricks[3];

  Grid(const double from[3], const double to[3], double edge) : cell(edge) {
    for (int k = 0; k < 3; ++k) {
      low[k] = from[k] - kMargin * cell;
      bricks[k] = static_cast<std::uint32_t>(
          std::floor((to[k] + kMargin * cell - low[k]) / (kBrickWidth * cell)) + 1);
    }
  }

  double brick_places() const { return double{1} * bricks[0] * bricks[1] * bricks[2]; }
  std::uint32_t cells(int k) const { return kBrickWidth * bricks[k]; }

  /// Its brick's place · 64 + its bit.
  std::uint64_t name(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    const std::uint64_t brick =
        x / kBrickWidth +
        std::uint64_t{bricks[0]} * (y / kBrickWidth + std::uint64_t{bricks[1]} * (z / kBrickWidth));
    return 64 * brick + x % kBrickWidth + 4 * (y % kBrickWidth) + 16 * (z % kBrickWidth);
  }

  std::array<double, 3> reference(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return {low[0] + (x + kCellReference[0]) * cell, low[1] + (y + kCellReference[1]) * cell,
            low[2] + (z + kCellReference[2]) * cell};
  }
};

/// A box of cells, `end` not included.
struct CellRange {
  std::uint32_t begin[3], end[3];
};

/// Calls visit(x, y, z) for the cells of a range that the triangle meets, by halves.
template <class Visit>
void for_cells(const Grid& grid, const CellOverlap& triangle, const CellRange& range,
               const Visit& visit) {
  double centre[3], half[3];
  int longest = 0;
  for (int k = 0; k < 3; ++k) {
    centre[k] = grid.low[k] + (double{1} * range.begin[k] + range.end[k]) / 2 * grid.cell;
    half[k] = double{1} * (range.end[k] - range.begin[k]) / 2 * grid.cell +
              (kEnlarged * grid.cell + kEnlargedBy);
    if (range.end[k] - range.begin[k] > range.end[longest] - range.begin[longest]) longest = k;
  }
  if (!triangle.meets(centre, half)) return;
  const std::uint32_t length = range.end[longest] - range.begin[longest];
  if (length == 1) {
    visit(range.begin[0], range.begin[1], range.begin[2]);
    return;
  }
  CellRange first = range, second = range;
  first.end[longest] = second.begin[longest] = range.begin[longest] + length / 2;
  for_cells(grid, triangle, first, visit);
  for_cells(grid, triangle, second, visit);
}

/// The cells that may hold a point of a triangle's box.
CellRange range_of(const Grid& grid, const TriangleCorners& t) {
  CellRange range;
  const double room = kEnlarged * grid.cell + kEnlargedBy;
  for (int k = 0; k < 3; ++k) {
    const double from = std::min({t.p[0][k], t.p[1][k], t.p[2][k]}) - room - grid.low[k];
    const double to = std::max({t.p[0][k], t.p[1][k], t.p[2][k]}) + room - grid.low[k];
    const double last = grid.cells(k) - 1;
    range.begin[k] =
        static_cast<std::uint32_t>(std::clamp(std::floor(from / grid.cell), 0.0, last));
    range.end[k] =
        static_cast<std::uint32_t>(std::clamp(std::floor(to / grid.cell), 0.0, last)) + 1;
  }
  return range;
}

/// A triangle in a cell.
struct Entry {
  std::uint64_t cell;      ///< Grid::name
  std::uint32_t triangle;  ///< 16 · block + lane
  friend auto operator<=>(const Entry&, const Entry&) = default;
};

/// All of them, sorted; nothing where there are more than `most`.
std::optional<std::vector<Entry>> find_entries(const Grid& grid,
                                               const std::vector<SurfaceBlock>& blocks,
                                               std::size_t most) {
  std::vector<std::vector<Entry>> of_block(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    for (std::uint32_t lane = 0; lane < blocks[b].triangles; ++lane) {
      const TriangleCorners t = corners_of(blocks[b], lane);
      const auto code = static_cast<std::uint32_t>(kWidth * b + lane);
      for_cells(grid, CellOverlap(t.p[0], t.p[1], t.p[2]), range_of(grid, t),
                [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
                  of_block[b].push_back({grid.name(x, y, z), code});
                });
      if (of_block[b].size() > most) return;
    }
  });
  std::size_t count = 0;
  for (const auto& some : of_block) count += some.size();
  if (count > most) return std::nullopt;
  std::vector<Entry> entries;
  entries.reserve(count);
  for (const auto& some : of_block) entries.insert(entries.end(), some.begin(), some.end());
  tbb::parallel_sort(entries.begin(), entries.end());
  return entries;
}

/// The cells by their bricks, all of them.
struct DenseBricks {
  std::vector<std::uint64_t> surface, inside;

  explicit DenseBricks(const Grid& grid)
      : surface(static_cast<std::size_t>(grid.brick_places())), inside(surface.size()) {}
  static bool bit(const std::vector<std::uint64_t>& of, std::uint64_t cell) {
    return (of[cell / 64] >> cell % 64 & 1) != 0;
  }
  static void set(std::vector<std::uint64_t>& of, std::uint64_t cell) {
    of[cell / 64] |= std::uint64_t{1} << cell % 64;
  }
};

/// The reference point of no cell is too near to one of the cell's triangles.
bool references_are_clear(const Grid& grid, const std::vector<SurfaceBlock>& blocks,
                          const std::vector<Entry>& entries) {
  std::vector<std::uint8_t> clear(entries.size());
  const double least2 = kNearest * grid.cell * (kNearest * grid.cell);
  tbb::parallel_for(std::size_t{0}, entries.size(), [&](std::size_t i) {
    const std::uint64_t brick = entries[i].cell / 64, bit = entries[i].cell % 64;
    const std::uint64_t x = brick % grid.bricks[0], yz = brick / grid.bricks[0];
    const std::uint64_t y = yz % grid.bricks[1], z = yz / grid.bricks[1];
    const std::array<double, 3> p =
        grid.reference(static_cast<std::uint32_t>(kBrickWidth * x + bit % 4),
                       static_cast<std::uint32_t>(kBrickWidth * y + bit / 4 % 4),
                       static_cast<std::uint32_t>(kBrickWidth * z + bit / 16));
    const TriangleCorners t =
        corners_of(blocks[entries[i].triangle / kWidth], entries[i].triangle % kWidth);
    const TriangleFrame<double> frame = make_triangle_frame(t.p[0], t.p[1], t.p[2]);
    clear[i] = closest_in_frame(frame, p.data()).distance2 > least2;
  });
  return std::all_of(clear.begin(), clear.end(), [](std::uint8_t is) { return is != 0; });
}

/// Sets the inside bits, a plane of bricks at a time. From a cell without surface to the next along
/// x the winding number does not change.
void find_inside(const Grid& grid, const MeshView& surface, DenseBricks& bricks) {
  tbb::parallel_for(std::uint32_t{0}, grid.bricks[2], [&](std::uint32_t plane) {
    for (std::uint32_t z = kBrickWidth * plane; z < kBrickWidth * (plane + 1); ++z)
      for (std::uint32_t y = 0; y < grid.cells(1); ++y) {
        bool inside = false, known = false;
        for (std::uint32_t x = 0; x < grid.cells(0); ++x) {
          const std::uint64_t cell = grid.name(x, y, z);
          const bool holds_surface = DenseBricks::bit(bricks.surface, cell);
          if (holds_surface || !known)
            inside = winding_number(surface, grid.reference(x, y, z).data()) % 2 != 0;
          known = !holds_surface;
          if (inside) DenseBricks::set(bricks.inside, cell);
        }
      }
  });
}

void write_grid(const Grid& grid, const DenseBricks& bricks, const std::vector<Entry>& entries,
                FieldArrays& arrays) {
  std::copy_n(grid.low, 3, arrays.header.low);
  std::copy_n(grid.bricks, 3, arrays.header.bricks);
  arrays.header.cell = grid.cell;
  arrays.brick_index.resize(bricks.surface.size());
  std::uint32_t cells = 0;
  for (std::size_t i = 0; i < bricks.surface.size(); ++i) {
    std::uint32_t& index = arrays.brick_index[i];
    const std::uint64_t surface = bricks.surface[i], inside = bricks.inside[i];
    if (surface == 0 && (inside == 0 || ~inside == 0)) {
      index = inside == 0 ? kOutsideBrick : kInsideBrick;
      continue;
    }
    index = static_cast<std::uint32_t>(arrays.bricks.size());
    arrays.bricks.push_back({surface, inside, cells, 0});
    cells += static_cast<std::uint32_t>(std::popcount(surface));
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i == 0 || entries[i].cell != entries[i - 1].cell)
      arrays.cell_first.push_back(static_cast<std::uint32_t>(i));
    arrays.cell_triangles.push_back(entries[i].triangle);
  }
  arrays.cell_first.push_back(static_cast<std::uint32_t>(entries.size()));
}

/// The smallest box around the surface, and the edge that makes cells as many as triangles.
struct Measures {
  double low[3], high[3];
  double edge;

  explicit Measures(const MeshView& surface) {
    std::fill(low, low + 3, HUGE_VAL);
    std::fill(high, high + 3, -HUGE_VAL);
    for (std::size_t c = 0; c < 3 * std::size_t{surface.triangle_count}; ++c)
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = surface.vertices[3 * std::size_t{surface.triangles[c]} + k];
        low[k] = std::min(low[k], x);
        high[k] = std::max(high[k], x);
      }
    // A surface meets three halves as many cells as squares of their edge have its area.
    edge = std::sqrt(1.5 * surface_area(surface) / std::max(surface.triangle_count, 64u));
    for (int k = 0; k < 3; ++k) edge = std::max(edge, (high[k] - low[k]) / 4096);
  }

  double largest_side() const {
    return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  }
};

}  // namespace

void lay_sign_grid(const MeshView& surface, FieldArrays& arrays) {
  const Measures measures(surface);
  const std::size_t triangles = surface.triangle_count;
  double edge = measures.edge;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const Grid grid(measures.low, measures.high, edge);
    const bool coarsest = edge > measures.largest_side();
    if (grid.brick_places() > 4096 + 2.0 * static_cast<double>(triangles) && !coarsest) {
      edge *= 1.125;
      continue;
    }
    const auto entries =
        find_entries(grid, arrays.blocks, coarsest ? 64 * triangles : 4096 + 16 * triangles);
    if (!entries) {
      edge *= 1.25;
      continue;
    }
    if (!references_are_clear(grid, arrays.blocks, *entries)) {
      edge *= kAnother;
      continue;
    }
    DenseBricks bricks(grid);
    for (const Entry& entry : *entries) DenseBricks::set(bricks.surface, entry.cell);
    find_inside(grid, surface, bricks);
    write_grid(grid, bricks, *entries, arrays);
    return;
  }
  throw Error(
      "the surface fills its cells so that no point of them is clear of it; bake without a "
      "field");
}

}  // namespace ist
