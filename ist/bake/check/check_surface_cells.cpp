#include <algorithm>
#include <bit>
#include <cmath>

#include "bake/check/check_surface.h"
#include "bake/check/check_tally.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;
using Polygon = std::vector<Point>;

/// The part of a polygon where sign · (p[axis] − bound) ≥ 0.
Polygon cut(const Polygon& polygon, int axis, double bound, double sign) {
  Polygon out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double from = sign * (a[axis] - bound), to = sign * (b[axis] - bound);
    if (from >= 0) out.push_back(a);
    if ((from > 0 && to < 0) || (from < 0 && to > 0))
      out.push_back(a + (b - a) * (from / (from - to)));
  }
  return out;
}

/// Numbers of `width` bytes.
std::vector<std::uint32_t> wide(const AssetHeader& asset, std::uint64_t offset, std::size_t count,
                                std::uint32_t width) {
  if (width == 4)
    return {at<std::uint32_t>(asset, offset), at<std::uint32_t>(asset, offset) + count};
  return {at<std::uint16_t>(asset, offset), at<std::uint16_t>(asset, offset) + count};
}

/// The cells as the file has them.
class Cells {
 public:
  Cells(const AssetHeader& asset, const SurfaceHeader& surface)
      : surface_(surface),
        index_(at<std::uint32_t>(asset, surface.brick_index)),
        bricks_(at<CellBrick>(asset, surface.brick_data)),
        ends_(wide(asset, surface.cell_ends, surface.cell_count, surface.list_bytes)),
        triangles_(wide(asset, surface.cell_triangles, surface.entry_count, surface.list_bytes)) {}

  /// Whether the cell lists the triangle.
  bool lists(const std::array<std::int64_t, 3>& cell, std::uint32_t triangle) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (cell[k] < 0 || cell[k] >= std::int64_t{kBrickWidth} * surface_.bricks[k]) return false;
    const auto x = static_cast<std::uint64_t>(cell[0]), y = static_cast<std::uint64_t>(cell[1]),
               z = static_cast<std::uint64_t>(cell[2]);
    const std::uint32_t code =
        index_[x / 4 + surface_.bricks[0] * (y / 4 + std::uint64_t{surface_.bricks[1]} * (z / 4))];
    if (code >= surface_.brick_count) return false;
    const CellBrick& brick = bricks_[code];
    const auto bit = static_cast<std::uint32_t>(x % 4 + 4 * (y % 4) + 16 * (z % 4));
    if ((brick.surface >> bit & 1) == 0) return false;
    const std::uint64_t before = brick.surface & ((std::uint64_t{1} << bit) - 1);
    const std::uint32_t at = brick.first + static_cast<std::uint32_t>(std::popcount(before));
    const std::uint32_t* const list = triangles_.data() + brick.list;
    const std::uint32_t *const begin = list + (before == 0 ? 0 : ends_[at - 1]), *const end =
                                                                                     list +
                                                                                     ends_[at];
    return std::find(begin, end, triangle) != end;
  }

  std::size_t places() const {
    return std::size_t{surface_.bricks[0]} * surface_.bricks[1] * surface_.bricks[2];
  }

  /// Runs visit(reference point, holds surface, inside) on the cells of a place; on one of them
  /// where all are alike.
  template <class Visit>
  void visit(std::size_t place, const Visit& visit) const {
    const std::uint32_t code = index_[place];
    if (code >= surface_.brick_count)
      return visit(reference(place, 0), false, code == kInsideBrick);
    for (std::uint32_t bit = 0; bit < 64; ++bit)
      visit(reference(place, bit), (bricks_[code].surface >> bit & 1) != 0,
            (bricks_[code].inside >> bit & 1) != 0);
  }

 private:
  Point reference(std::size_t place, std::uint32_t bit) const {
    const std::size_t at[3] = {4 * (place % surface_.bricks[0]) + bit % 4,
                               4 * (place / surface_.bricks[0] % surface_.bricks[1]) + bit / 4 % 4,
                               4 * (place / surface_.bricks[0] / surface_.bricks[1]) + bit / 16};
    Point p;
    for (int k = 0; k < 3; ++k)
      p[k] = surface_.low[k] + (static_cast<double>(at[k]) + kCellReference[k]) * surface_.cell;
    return p;
  }

  const SurfaceHeader& surface_;
  const std::uint32_t* index_;
  const CellBrick* bricks_;
  const std::vector<std::uint32_t> ends_, triangles_;
};

/// Cuts a triangle along the cells' sides and looks its pieces up.
class Listing {
 public:
  Listing(const SurfaceHeader& surface, const Cells& cells, std::uint32_t triangle, Tally& tally)
      : surface_(surface), cells_(cells), triangle_(triangle), tally_(tally) {}

  void look_up(const Polygon& piece, int axis) {
    if (piece.empty()) return;
    if (axis == 3) return tally_.add(cells_.lists(cell_, triangle_) ? 0 : 1, triangle_);
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Point& p : piece) {
      low = std::min(low, p[axis]);
      high = std::max(high, p[axis]);
    }
    const auto slab = [&](double x) {
      return static_cast<std::int64_t>(std::floor((x - surface_.low[axis]) / surface_.cell));
    };
    for (std::int64_t i = slab(low); i <= slab(high); ++i) {
      cell_[static_cast<std::size_t>(axis)] = i;
      const double from = surface_.low[axis] + static_cast<double>(i) * surface_.cell;
      look_up(cut(cut(piece, axis, from, 1), axis, from + surface_.cell, -1), axis + 1);
    }
  }

 private:
  const SurfaceHeader& surface_;
  const Cells& cells_;
  const std::uint32_t triangle_;
  Tally& tally_;
  std::array<std::int64_t, 3> cell_ = {};
};

}  // namespace

std::vector<Invariant> check_surface_cells(const AssetHeader& asset, const SurfaceHeader& surface,
                                           const CheckedMesh& of_surface,
                                           const CheckedMesh& solid) {
  const SurfaceTriangles triangles(asset, surface);
  const Cells cells(asset, surface);
  std::vector<Invariant> out;
  out.push_back(
      tally_all(triangles.blocks(), [&](std::size_t b, Tally& tally) {
        for (std::uint32_t l = 0; l < triangles.lanes(b); ++l) {
          const CheckedMesh::Corners t = triangles.corners(b, l);
          Listing(surface, cells, static_cast<std::uint32_t>(kWidth * b + l), tally)
              .look_up({t.begin(), t.end()}, 0);
        }
      }).named("surface cells", "1 for a cell that does not list a triangle that intersects it"));
  out.push_back(
      tally_all(cells.places(), [&](std::size_t place, Tally& tally) {
        cells.visit(place, [&](const Point& p, bool, bool inside) {
          tally.add((of_surface.winding(p) % 2 != 0) != inside ? 1 : 0, place);
        });
      }).named("surface signs", "1 for a cell whose sign is not that of its reference point"));
  out.push_back(
      tally_all(cells.places(),
                [&](std::size_t place, Tally& tally) {
                  cells.visit(place, [&](const Point& p, bool holds_surface, bool inside) {
                    if (holds_surface || solid.distance(p, 2 * surface.error) <= surface.error)
                      return;
                    tally.add((solid.winding(p) >= 1) != inside ? 1 : 0, place);
                  });
                })
          .named("surface inside",
                 "1 for a cell without surface that lies farther than the error from the mesh and "
                 "on its other side"));
  return out;
}

}  // namespace ist
