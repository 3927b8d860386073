#include "mesh/resolve/patch_winding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "mesh/disjoint_sets.h"
#include "mesh/resolve/unresolvable.h"
#include "mesh/shells.h"

namespace ist {
namespace {

constexpr double kPatches = 0.1;  // share of the whole work, about

/// Triangles by the cells of a grid that they may cover, seen along an axis.
class Columns {
 public:
  Columns(const std::vector<Triangle>& triangles, const ExactPoints& points, const int axis)
      : axes_{(axis + 1) % 3, (axis + 2) % 3} {
    Eigen::Array2d high;
    for (const int i : {0, 1}) {
      low_[i] = HUGE_VAL;
      high[i] = -HUGE_VAL;
      for (const Triangle& t : triangles)
        for (const std::uint32_t v : t) {
          low_[i] = std::min(low_[i], points.rounded(v)[axes_[i]]);
          high[i] = std::max(high[i], points.rounded(v)[axes_[i]]);
        }
    }
    cells_ = std::clamp<std::size_t>(
        static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles.size()))), 1, 1024);
    const Eigen::Array2d size = high - low_;
    for (const int i : {0, 1})
      per_unit_[i] = size[i] > 0 ? static_cast<double>(cells_) / size[i] : 0;
    begin_.assign(cells_ * cells_ + 1, 0);
    const auto each_cell = [&](const auto& visit) {
      for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        std::array<std::size_t, 2> from = {cells_, cells_}, to = {0, 0};
        for (const std::uint32_t v : triangles[t])
          for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
            from[i] = std::min(from[i], cell(points.rounded(v), static_cast<int>(i)));
            to[i] = std::max(to[i], cell(points.rounded(v), static_cast<int>(i)));
          }
        for (std::size_t y = from[1]; y <= to[1]; ++y)
          for (std::size_t x = from[0]; x <= to[0]; ++x) visit(y * cells_ + x, t);
      }
    };
    each_cell([&](const std::size_t c, std::uint32_t) { ++begin_[c + 1]; });
    for (std::size_t c = 0; c < cells_ * cells_; ++c) begin_[c + 1] += begin_[c];
    listed_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    each_cell([&](const std::size_t c, const std::uint32_t t) { listed_[next[c]++] = t; });
  }

  /// Those that a line along the axis through p may meet.
  std::span<const std::uint32_t> about(const Eigen::Vector3d& p) const {
    const std::size_t c = cell(p, 1) * cells_ + cell(p, 0);
    return std::span(listed_).subspan(begin_[c], begin_[c + 1] - begin_[c]);
  }

 private:
  /// Grows with the coordinate, whatever is rounded.
  std::size_t cell(const Eigen::Vector3d& p, const int i) const {
    const double at = (p[axes_[i]] - low_[i]) * per_unit_[i];
    return at > 0 ? std::min(cells_ - 1, static_cast<std::size_t>(at)) : 0;
  }

  int axes_[2];
  Eigen::Array2d low_ = {0, 0}, per_unit_ = {0, 0};
  std::size_t cells_ = 1;
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> listed_;
};

class Rays {
 public:
  Rays(const std::vector<Triangle>& triangles, const Arrangement& arrangement)
      : triangles_(triangles), arrangement_(arrangement), points_(arrangement.points) {}

  /// The winding number in front of a piece, by a line along an axis through a point of it that
  /// meets no edge.
  int in_front(const std::uint32_t piece) {
    const Triangle& corners = arrangement_.pieces[piece];
    const Eigen::Vector3d a = points_.rounded(corners[0]);
    int axis = 0;
    (points_.rounded(corners[1]) - a)
        .cross(points_.rounded(corners[2]) - a)
        .cwiseAbs()
        .maxCoeff(&axis);
    int facing = 0;
    for (int tried = 0; facing == 0; ++tried, axis = (axis + 1) % 3) {
      if (tried == 3) throw Unresolvable{"a piece of a triangle is degenerate"};
      facing = points_.turn(axis, corners[0], corners[1], corners[2]);
      if (facing != 0) break;
    }
    std::uint32_t random = 1;
    for (int tried = 0; tried < 100; ++tried) {
      const ExactPoint inside = point_within(corners, random);
      const RoundedPoint rounded = points_.round(inside);
      if (const auto winding = count({&rounded, &inside}, piece, axis, facing)) return *winding;
    }
    throw Unresolvable{"every ray through a piece of a triangle hits an edge"};
  }

 private:
  ExactPoint point_within(const Triangle& corners, std::uint32_t& random) const {
    std::array<ExactPoint, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = points_.exact(corners[k]);
    ExactPoint sum = {{0, 0, 0}, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      random = random * 1664525 + 1013904223;
      const Whole weight = 256 + (random >> 23);
      sum.w += weight;
      const Whole others = weight * p[(k + 1) % 3].w * p[(k + 2) % 3].w;
      for (std::size_t i = 0; i < 3; ++i) sum.x[i] += others * p[k].x[i];
    }
    sum.w *= p[0].w * p[1].w * p[2].w;
    return sum;
  }

  /// Nothing where the line meets an edge.
  std::optional<int> count(const PointView& from, const std::uint32_t piece, const int axis,
                           const int facing) {
    const std::uint32_t own = arrangement_.plane[arrangement_.source[piece]];
    int winding = 0;
    for (const std::uint32_t t : columns(axis).about(from.rounded->at)) {
      if (arrangement_.plane[t] == own) continue;
      const Triangle& corner = triangles_[t];
      int turns[3] = {0, 0, 0};
      bool left = false, right = false;
      for (std::size_t k = 0; k < 3 && !(left && right); ++k) {
        turns[k] =
            points_.turn(axis, points_.view(corner[k]), points_.view(corner[(k + 1) % 3]), from);
        left |= turns[k] > 0;
        right |= turns[k] < 0;
      }
      if (left && right) continue;
      if (turns[0] == 0 || turns[1] == 0 || turns[2] == 0) {
        if (points_.turn(axis, corner[0], corner[1], corner[2]) == 0) continue;
        return std::nullopt;
      }
      const int side = points_.side(corner, from), out = turns[0] * facing;
      if (side * out < 0) winding += out;  // a triangle in the piece's own plane has side 0
    }
    return winding;
  }

  const Columns& columns(const int axis) {
    const auto k = static_cast<std::size_t>(axis);
    std::call_once(made_[k], [&] { columns_[k].emplace(triangles_, points_, axis); });
    return *columns_[k];
  }

  const std::vector<Triangle>& triangles_;
  const Arrangement& arrangement_;
  const ExactPoints& points_;
  std::array<std::once_flag, 3> made_;
  std::array<std::optional<Columns>, 3> columns_;
};

}  // namespace

Patches find_patches(const std::vector<Triangle>& triangles, const Arrangement& arrangement,
                     WatchedWork& work) {
  const std::vector<Triangle>& pieces = arrangement.pieces;
  const EdgeTable edges(pieces);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    int balance = 0;
    for (const std::uint32_t side : edges.sides(e))
      balance += (runs_up(pieces, side) ? 1 : -1) * arrangement.winding_step[side / 3];
    if (balance != 0) throw Unresolvable{"the pieces of the surface do not form a closed surface"};
  }
  DisjointSets sets = manifold_patches(pieces, edges);
  Patches patches;
  patches.of_piece.resize(pieces.size());
  std::vector<std::uint32_t> largest;  // [patch] a piece
  std::vector<double> size;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    const Eigen::Vector3d& a = arrangement.points.rounded(pieces[p][0]);
    const double area = (arrangement.points.rounded(pieces[p][1]) - a)
                            .cross(arrangement.points.rounded(pieces[p][2]) - a)
                            .squaredNorm();
    const std::uint32_t first = sets.find(p);  // the smallest
    if (first == p) {
      patches.of_piece[p] = static_cast<std::uint32_t>(largest.size());
      largest.push_back(p);
      size.push_back(area);
      continue;
    }
    const std::uint32_t patch = patches.of_piece[p] = patches.of_piece[first];
    if (area > size[patch]) {
      largest[patch] = p;
      size[patch] = area;
    }
  }
  patches.in_front.resize(largest.size());
  Rays rays(triangles, arrangement);
  work.for_each(largest.size(), kPatches, [&](const std::size_t patch) {
    patches.in_front[patch] = rays.in_front(largest[patch]);
  });
  return patches;
}

}  // namespace ist
