#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/triangle_strip.h"

namespace ist {

/// Triangles grouped by the cells of a grid that they may cover, seen along an axis.
class TriangleColumns {
 public:
  /// `position(v)` returns the position of a vertex.
  template <class Position>
  TriangleColumns(const std::vector<Triangle>& triangles, int axis, const Position& position)
      : axes_{(axis + 1) % 3, (axis + 2) % 3} {
    const auto box_of = [&](const Triangle& t) {
      Eigen::AlignedBox2d box;
      for (const std::uint32_t v : t) box.extend(seen(position(v)));
      return box;
    };
    Eigen::AlignedBox2d all;
    for (const Triangle& t : triangles) all.extend(box_of(t));
    cells_ = static_cast<std::size_t>(
        std::clamp(std::sqrt(static_cast<double>(triangles.size())), 1.0, 1024.0));
    low_ = all.min();
    for (const int i : {0, 1})
      per_unit_[i] = all.sizes()[i] > 0 ? static_cast<double>(cells_) / all.sizes()[i] : 0;
    at_cells_ = ItemGroups<std::size_t>(cells_ * cells_, [&](const auto& visit) {
      for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const Eigen::AlignedBox2d box = box_of(triangles[t]);
        const auto from = cell(box.min()), to = cell(box.max());
        const auto row = [&](std::size_t y, std::size_t first, std::size_t last) {
          for (std::size_t x = first; x <= last; ++x) visit(y * cells_ + x, t);
        };
        if (to[1] < from[1] + 2 || to[0] < from[0] + 2) {
          for (std::size_t y = from[1]; y <= to[1]; ++y) row(y, from[0], to[0]);
          continue;
        }
        std::array<double, 3> x, y;
        for (std::size_t k = 0; k < 3; ++k) {
          const Eigen::Vector2d at =
              (seen(position(triangles[t][k])) - low_).cwiseProduct(per_unit_);
          x[k] = at[0];
          y[k] = at[1];
        }
        const TriangleStrip strip(x, y);
        for (std::size_t r = from[1]; r <= to[1]; ++r) {
          constexpr double kMargin = 1e-6;  // exceeds all rounding
          const double one = strip.at(static_cast<double>(r)), next = one + strip.slope;
          row(r, std::max(from[0], place(std::min(one, next) + strip.left - kMargin)),
              std::min(to[0], place(std::max(one, next) + strip.right + kMargin)));
        }
      }
    });
  }

  /// The triangles that a line along the axis through p may meet, ascending.
  std::span<const std::uint32_t> about(const Eigen::Vector3d& p) const {
    const auto [x, y] = cell(seen(p));
    return at_cells_[y * cells_ + x];
  }

 private:
  Eigen::Vector2d seen(const Eigen::Vector3d& p) const { return {p[axes_[0]], p[axes_[1]]}; }

  /// Monotone in the coordinates, in spite of rounding.
  std::array<std::size_t, 2> cell(const Eigen::Vector2d& p) const {
    const auto along = [&](int i) { return place((p[i] - low_[i]) * per_unit_[i]); };
    return {along(0), along(1)};
  }

  std::size_t place(double at) const {
    return at > 0 ? std::min(cells_ - 1, static_cast<std::size_t>(at)) : 0;
  }

  int axes_[2];
  Eigen::Vector2d low_, per_unit_;
  std::size_t cells_;
  ItemGroups<std::size_t> at_cells_;
};

}  // namespace ist
