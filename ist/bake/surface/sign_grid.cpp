#include "bake/surface/sign_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <ist/error.h>

#include "bake/surface/brick_grid.h"
#include "bake/surface/cell_entries.h"
#include "bake/surface/surface_area.h"
#include "mesh/exact_sign.h"
#include "mesh/ray_crossing.h"
#include "mesh/triangle_frame.h"
#include "mesh/triangles_in_box.h"

namespace ist {
namespace {

constexpr double kNearest = 1e-9;     // of a cell: reference points keep away from triangles
constexpr double kAnother = 1.00391;  // of a cell whose reference points do not
constexpr double kSurely = 1e4;       // of a squared distance, so that rounding does not matter
constexpr int kTries = 1000;

/// The cells by their bricks, all of them.
struct DenseBricks {
  std::vector<std::uint64_t> surface, inside;

  explicit DenseBricks(const BrickGrid& grid)
      : surface(static_cast<std::size_t>(grid.brick_places())), inside(surface.size()) {}
  static bool bit(const std::vector<std::uint64_t>& of, std::uint64_t cell) {
    return (of[cell / 64] >> cell % 64 & 1) != 0;
  }
  static void set(std::vector<std::uint64_t>& of, std::uint64_t cell) {
    of[cell / 64] |= std::uint64_t{1} << cell % 64;
  }
};

/// The reference point of no cell is too near to one of the cell's triangles.
bool references_are_clear(const BrickGrid& grid, const std::vector<SurfaceBlock>& blocks,
                          const std::vector<CellEntry>& entries) {
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
    const LaneCorners t =
        corners_of(blocks[entries[i].triangle / kWidth], entries[i].triangle % kWidth);
    // Nearly always the plane is far enough to say so.
    double n[3];
    area_normal(t.p[0], t.p[1], t.p[2], n);
    const double w[3] = {p[0] - t.p[0][0], p[1] - t.p[0][1], p[2] - t.p[0][2]};
    const double height = dot3(n, w);
    clear[i] = height * height > kSurely * least2 * dot3(n, n);
    if (clear[i] != 0) return;
    const TriangleFrame<double> frame = make_triangle_frame(t.p[0], t.p[1], t.p[2]);
    clear[i] = closest_in_frame(frame, p.data()).distance2 > least2;
  });
  return std::all_of(clear.begin(), clear.end(), [](std::uint8_t is) { return is != 0; });
}

/// Winding numbers on a line parallel to x, modulo 2: the triangles that lie beyond a point.
class RowParity {
 public:
  explicit RowParity(const MeshView& surface) : surface_(surface) {}

  /// Of a point of the line of the last point, or of another.
  bool is_odd(const std::array<double, 3>& p) {
    if (p[1] != yz_[0] || p[2] != yz_[1]) look_along(p[1], p[2]);
    bool odd = false;
    for (const auto& [t, facing, extent] : pierced_)
      odd ^= p[0] < extent.low ||
             (p[0] <= extent.high && orient3d_sign(t.p[0], t.p[1], t.p[2], p.data()) * facing > 0);
    return odd;
  }

 private:
  struct Pierced {
    Corners triangle;
    int facing;
    Extent extent;
  };

  void look_along(double y, double z) {
    yz_[0] = y;
    yz_[1] = z;
    pierced_.clear();
    const RayBox box = RayBox::line(y, z);
    none_in_box(surface_, box.lower, box.upper, [&](const Corners& t) {
      const int facing = pierced(t, yz_);
      if (facing != 0) pierced_.push_back({t, facing, Extent(t)});
      return false;
    });
  }

  const MeshView& surface_;
  double yz_[2] = {HUGE_VAL, HUGE_VAL};
  std::vector<Pierced> pierced_;
};

/// Sets the inside bits, a row of bricks at a time. From a cell without surface to the next along
/// x the winding number does not change.
void find_inside(const BrickGrid& grid, const MeshView& surface, DenseBricks& bricks) {
  tbb::parallel_for(std::uint32_t{0}, grid.bricks[1] * grid.bricks[2], [&](std::uint32_t row) {
    const std::uint32_t from_y = kBrickWidth * (row % grid.bricks[1]);
    const std::uint32_t from_z = kBrickWidth * (row / grid.bricks[1]);
    RowParity parity(surface);
    for (std::uint32_t z = from_z; z < from_z + kBrickWidth; ++z)
      for (std::uint32_t y = from_y; y < from_y + kBrickWidth; ++y) {
        // Before a row's first cell with surface it is outside.
        bool inside = false, known = true;
        for (std::uint32_t x = 0; x < grid.cells(0); ++x) {
          const std::uint64_t cell = grid.name(x, y, z);
          const bool holds_surface = DenseBricks::bit(bricks.surface, cell);
          if (holds_surface || !known) inside = parity.is_odd(grid.reference(x, y, z));
          known = !holds_surface;
          if (inside) DenseBricks::set(bricks.inside, cell);
        }
      }
  });
}

/// SurfaceHeader::list_bytes for these lists.
std::uint32_t list_bytes(std::size_t blocks, std::size_t fullest_brick) {
  return kWidth * blocks > 0x10000 || fullest_brick > 0xffff ? 4 : 2;
}

/// What write_grid() will fill.
std::size_t bytes_of(const BrickGrid& grid, std::size_t blocks, const EntryCounts& counts) {
  return static_cast<std::size_t>(grid.brick_places()) * sizeof(std::uint32_t) +
         counts.bricks * sizeof(CellBrick) +
         (counts.cells + counts.entries) * list_bytes(blocks, counts.fullest_brick);
}

void write_grid(const BrickGrid& grid, const DenseBricks& bricks,
                const std::vector<CellEntry>& entries, SurfaceArrays& arrays) {
  std::copy_n(grid.low, 3, arrays.header.low);
  std::copy_n(grid.bricks, 3, arrays.header.bricks);
  arrays.header.cell = grid.cell;
  arrays.brick_index.resize(bricks.surface.size());
  std::uint32_t cells = 0, lists = 0;
  std::size_t fullest = 0;
  for (std::size_t i = 0; i < bricks.surface.size(); ++i) {
    std::uint32_t& index = arrays.brick_index[i];
    const std::uint64_t surface = bricks.surface[i], inside = bricks.inside[i];
    if (surface == 0 && (inside == 0 || ~inside == 0)) {
      index = inside == 0 ? kOutsideBrick : kInsideBrick;
      continue;
    }
    index = static_cast<std::uint32_t>(arrays.bricks.size());
    arrays.bricks.push_back({surface, inside, cells, lists});
    cells += static_cast<std::uint32_t>(std::popcount(surface));
    std::uint32_t end = lists;
    for (; end < entries.size() && entries[end].cell / 64 == i; ++end) {
      if (end > lists && entries[end].cell != entries[end - 1].cell)
        arrays.cell_ends.push_back(end - lists);
      arrays.cell_triangles.push_back(entries[end].triangle);
    }
    if (end > lists) arrays.cell_ends.push_back(end - lists);
    fullest = std::max<std::size_t>(fullest, end - lists);
    lists = end;
  }
  arrays.header.list_bytes = list_bytes(arrays.blocks.size(), fullest);
}

/// The smallest box around the surface, and edges of cells.
struct Measures {
  double low[3], high[3];
  double edge;   ///< about as many cells as triangles
  double least;  ///< no cells are smaller

  explicit Measures(const MeshView& surface) {
    std::fill(low, low + 3, HUGE_VAL);
    std::fill(high, high + 3, -HUGE_VAL);
    for (std::size_t c = 0; c < 3 * std::size_t{surface.triangle_count}; ++c)
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = surface.vertices[3 * std::size_t{surface.triangles[c]} + k];
        low[k] = std::min(low[k], x);
        high[k] = std::max(high[k], x);
      }
    least = largest_side() / 4096;
    // A surface meets three halves as many cells as squares of their edge have its area.
    edge = std::max(least,
                    std::sqrt(1.5 * surface_area(surface) / std::max(surface.triangle_count, 64u)));
  }

  double largest_side() const {
    return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  }
};

/// What a grid of such cells takes; infinite where that is more than `most` by far.
double bytes_for(const Measures& measures, double edge, const std::vector<SurfaceBlock>& blocks,
                 std::size_t most) {
  const BrickGrid grid(measures.low, measures.high, edge);
  const double places = grid.brick_places() * sizeof(std::uint32_t);
  if (places > 2.0 * static_cast<double>(most)) return HUGE_VAL;
  const auto counts = count_entries(grid, blocks, most);
  return counts ? static_cast<double>(bytes_of(grid, blocks.size(), *counts)) : HUGE_VAL;
}

/// The edge of the smallest cells found that take at most, and nearly, so many bytes.
double edge_for(const Measures& measures, const std::vector<SurfaceBlock>& blocks,
                std::size_t bytes) {
  constexpr double kFull = 0.94;     // of the bytes: good enough
  constexpr double kExponent = 0.6;  // of the edge about bytes
  double edge = measures.edge, fine = 0, coarse = HUGE_VAL;
  for (int attempt = 0; attempt < 10; ++attempt) {
    const double ratio = bytes_for(measures, edge, blocks, bytes) / static_cast<double>(bytes);
    (ratio <= 1 ? coarse : fine) = edge;
    if (ratio <= 1 && (ratio > kFull || edge <= measures.least)) break;
    edge *= std::pow(std::clamp(ratio, 0.1, 3.0) / ((1 + kFull) / 2), kExponent);
    if (!(edge > fine && edge < coarse)) edge = std::sqrt(fine * coarse);
    edge = std::max(edge, measures.least);
    if (edge > measures.largest_side()) return edge;
  }
  return coarse < HUGE_VAL ? coarse : edge;
}

}  // namespace

void lay_sign_grid(const MeshView& surface, std::size_t bytes, SurfaceArrays& arrays) {
  const Measures measures(surface);
  double edge = edge_for(measures, arrays.blocks, bytes);
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const BrickGrid grid(measures.low, measures.high, edge);
    const bool coarsest = edge > measures.largest_side();
    const auto entries = find_entries(grid, arrays.blocks,
                                      coarsest ? std::numeric_limits<std::uint32_t>::max() : bytes);
    if (!entries) {
      edge *= 1.25;
      continue;
    }
    if (!references_are_clear(grid, arrays.blocks, *entries)) {
      edge *= kAnother;
      continue;
    }
    DenseBricks bricks(grid);
    for (const CellEntry& entry : *entries) DenseBricks::set(bricks.surface, entry.cell);
    find_inside(grid, surface, bricks);
    write_grid(grid, bricks, *entries, arrays);
    return;
  }
  throw Error(
      "the surface fills its grid cells, so no reference point clear of it exists; bake with "
      "surface none");
}

}  // namespace ist
