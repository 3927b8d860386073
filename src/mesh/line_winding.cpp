#include "mesh/line_winding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/exact_sign.h"

namespace ist {
namespace {

/// Which side of the edge from u to v the point lies on, seen in the yz plane: the same answer,
/// bit for bit, whichever of its triangles asks. On the edge counts as left.
bool left_of_upward_edge(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                         const Eigen::Vector3d& p) {
  return orient2d_sign(lower.data() + 1, upper.data() + 1, p.data() + 1) >= 0;
}

/// Turns of the triangle's outline around the point in the yz plane: −1, 0 or 1.
int turns_around(const std::array<Eigen::Vector3d, 3>& corners, const Eigen::Vector3d& p) {
  int turns = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& u = corners[k];
    const Eigen::Vector3d& v = corners[(k + 1) % 3];
    const bool u_below = u[1] <= p[1], v_below = v[1] <= p[1];
    if (u_below && !v_below && left_of_upward_edge(u, v, p)) ++turns;
    if (v_below && !u_below && left_of_upward_edge(v, u, p)) --turns;
  }
  return turns;
}

}  // namespace

LineWinding::LineWinding(const std::vector<Eigen::Vector3d>& vertices,
                         const std::vector<Triangle>& triangles, const Shells& shells)
    : vertices_(vertices), triangles_(triangles), shells_(shells) {
  Eigen::AlignedBox2d box;
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) box.extend(vertices[v].tail<2>());
  cells_ = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles.size()) / 2)), 1, 1024);
  low_ = box.min();
  for (int k = 0; k < 2; ++k) {
    const double width = box.max()[k] - box.min()[k];
    cells_per_unit_[k] = width > 0 ? static_cast<double>(cells_) / width : 0;
  }
  const auto for_each_cell = [&](const auto& visit) {
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      Eigen::AlignedBox2d of_triangle;
      for (const std::uint32_t v : triangles_[i]) of_triangle.extend(vertices_[v].tail<2>());
      const std::size_t first = column(of_triangle.min()[0], of_triangle.min()[1]);
      const std::size_t last = column(of_triangle.max()[0], of_triangle.max()[1]);
      for (std::size_t y = first / cells_; y <= last / cells_; ++y)
        for (std::size_t z = first % cells_; z <= last % cells_; ++z) visit(y * cells_ + z, i);
    }
  };
  begin_.assign(cells_ * cells_ + 1, 0);
  for_each_cell([&](const std::size_t cell, std::uint32_t) { ++begin_[cell + 1]; });
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) begin_[c + 1] += begin_[c];
  listed_.resize(begin_.back());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for_each_cell([&](const std::size_t cell, const std::uint32_t i) { listed_[next[cell]++] = i; });
}

std::size_t LineWinding::column(const double y, const double z) const {
  const auto cell = [&](const double offset, const double per_unit) {
    const double c = std::floor(offset * per_unit);
    return static_cast<std::size_t>(std::clamp(c, 0.0, static_cast<double>(cells_ - 1)));
  };
  return cell(y - low_[0], cells_per_unit_[0]) * cells_ + cell(z - low_[1], cells_per_unit_[1]);
}

void LineWinding::around(const Eigen::Vector3d& p, std::vector<int>& numbers,
                         std::vector<std::uint32_t>& shells_met) const {
  shells_met.clear();
  const std::size_t cell = column(p[1], p[2]);
  for (std::size_t i = begin_[cell]; i < begin_[cell + 1]; ++i) {
    const Triangle& t = triangles_[listed_[i]];
    const std::array<Eigen::Vector3d, 3> corners{vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
    const int turns = turns_around(corners, p);
    if (turns == 0) continue;
    // Beyond p in the direction of +x? Then p lies behind a triangle that faces that way.
    if (orient3d_sign(corners[0].data(), corners[1].data(), corners[2].data(), p.data()) != turns)
      continue;
    const std::uint32_t shell = shells_.of_triangle[listed_[i]];
    if (std::find(shells_met.begin(), shells_met.end(), shell) == shells_met.end())
      shells_met.push_back(shell);
    numbers[shell] += turns;
  }
}

}  // namespace ist
