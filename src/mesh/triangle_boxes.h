#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/edge_table.h"

namespace ist {

/// Eight boxes side by side. A box that is not there is empty: lower = ∞, upper = −∞.
struct alignas(64) EightBoxes {
  static constexpr std::size_t kWidth = 8;
  EightBoxes() {}  // left as they are, for threads to fill
  float lower[3][kWidth], upper[3][kWidth];

  /// Bit k: box k meets box `lane` of `other`.
  unsigned met_by(const EightBoxes& other, const std::size_t lane) const {
    constexpr int kBit[kWidth] = {1, 2, 4, 8, 16, 32, 64, 128};
    float low[3], high[3];
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = other.lower[i][lane];
      high[i] = other.upper[i][lane];
    }
    int met = 0;  // in a form that compilers make vector code of
    for (std::size_t k = 0; k < kWidth; ++k)
      met |= (lower[0][k] <= high[0] ? kBit[k] : 0) & (upper[0][k] >= low[0] ? kBit[k] : 0) &
             (lower[1][k] <= high[1] ? kBit[k] : 0) & (upper[1][k] >= low[1] ? kBit[k] : 0) &
             (lower[2][k] <= high[2] ? kBit[k] : 0) & (upper[2][k] >= low[2] ? kBit[k] : 0);
    return static_cast<unsigned>(met);
  }
};

/// Triangles along a space-filling curve, and boxes around each of them, around 8, 64, 512 … of
/// them. Degenerate triangles are left out. Coordinates are moved to the bounds' corner, divided by
/// their width and rounded to float, all of which keeps their order: boxes that meet still do.
class TriangleBoxes {
 public:
  /// On the caller's TBB threads. At most 2^21 triangles.
  TriangleBoxes(const std::vector<Eigen::Vector3d>& vertices,
                const std::vector<Triangle>& triangles);

  std::size_t size() const { return order_.size(); }
  /// The triangle at a place of the curve.
  std::uint32_t triangle(const std::size_t place) const { return order_[place]; }

  /// Into how many parts the search for pairs falls.
  std::size_t parts() const { return levels_[start_].size(); }

  /// Calls visit(i, j), i < j, for every two places whose boxes meet and that belong to one part of
  /// the search, until visit.done() is true.
  template <class Visit>
  void for_each_pair(const std::size_t part, Visit& visit) const {
    // A node of the starting level against itself and those behind it.
    within(start_, part, visit);
    if (start_ + 1 == levels_.size()) return;
    const std::vector<EightBoxes>& above = levels_[start_ + 1];
    for (std::size_t block = part / 8; block < above.size(); ++block) {
      unsigned met = above[block].met_by(above[part / 8], part % 8);
      if (block == part / 8) met &= ~1u << part % 8;
      for (; met != 0; met &= met - 1) between(start_, part, 8 * block + lowest(met), visit);
    }
  }

 private:
  static std::size_t lowest(const unsigned bits) {
    return static_cast<std::size_t>(std::countr_zero(bits));
  }

  template <class Visit>
  void within(const std::size_t level, const std::size_t node, Visit& visit) const {
    const EightBoxes& boxes = levels_[level][node];
    const std::size_t below = level == 0 ? order_.size() : levels_[level - 1].size();
    for (std::size_t k = 0; k < 8 && 8 * node + k < below; ++k) {
      if (level > 0) within(level - 1, 8 * node + k, visit);
      for (unsigned met = boxes.met_by(boxes, k) & ~1u << k; met != 0; met &= met - 1)
        pair(level, 8 * node + k, 8 * node + lowest(met), visit);
    }
  }

  /// All pairs of a triangle under node a with one under node b, both of a level, a < b.
  template <class Visit>
  void between(const std::size_t level, const std::size_t a, const std::size_t b,
               Visit& visit) const {
    if (visit.done()) return;
    const EightBoxes &of_a = levels_[level][a], &of_b = levels_[level][b];
    unsigned near_b = of_a.met_by(levels_[level + 1][b / 8], b % 8);
    for (; near_b != 0; near_b &= near_b - 1)
      for (unsigned met = of_b.met_by(of_a, lowest(near_b)); met != 0; met &= met - 1)
        pair(level, 8 * a + lowest(near_b), 8 * b + lowest(met), visit);
  }

  /// Children of a level's nodes.
  template <class Visit>
  void pair(const std::size_t level, const std::size_t a, const std::size_t b, Visit& visit) const {
    if (level == 0)
      visit(a, b);
    else
      between(level - 1, a, b, visit);
  }

  std::vector<std::uint32_t> order_;
  std::size_t start_ = 0;                        ///< level
  std::vector<std::vector<EightBoxes>> levels_;  ///< [0]: boxes of triangles; the last has one node
};

}  // namespace ist
