#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace ist {

/// Points that are asked for the nearest one and for those within reach: a k-d tree.
class PointTree {
 public:
  struct Nearest {
    double distance2 = std::numeric_limits<double>::infinity();
    std::uint32_t index = UINT32_MAX;  ///< smallest among equals; UINT32_MAX: no point is nearer
  };

  PointTree() = default;
  explicit PointTree(const std::vector<Eigen::Vector3d>& points);

  bool empty() const { return points_.empty(); }

  /// The nearest point closer than √limit2.
  Nearest nearest(const Eigen::Vector3d& p,
                  double limit2 = std::numeric_limits<double>::infinity()) const;

  /// Calls visit(index, distance²) for every point within `radius`, in an order of the tree's own.
  template <class Visit>
  void within(const Eigen::Vector3d& p, double radius, const Visit& visit) const {
    if (points_.empty() || !(radius >= 0)) return;
    const double radius2 = radius * radius;
    std::array<std::uint32_t, kDeepest> stack;
    int top = 0;
    stack[static_cast<std::size_t>(top++)] = 0;
    while (top > 0) {
      const Node& node = nodes_[stack[static_cast<std::size_t>(--top)]];
      if (box_distance2(node, p) > radius2) continue;
      if (node.left != 0) {
        stack[static_cast<std::size_t>(top++)] = node.left;
        stack[static_cast<std::size_t>(top++)] = node.left + 1;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.last; ++i) {
        const double d2 = (points_[i] - p).squaredNorm();
        if (d2 <= radius2) visit(order_[i], d2);
      }
    }
  }

 private:
  static constexpr std::size_t kDeepest = 96;
  static constexpr std::uint32_t kLeaf = 8;  ///< points a leaf

  struct Node {
    std::array<double, 3> low, high;
    std::uint32_t first, last;
    std::uint32_t left = 0;  ///< of two children side by side; 0: a leaf
  };

  static double box_distance2(const Node& node, const Eigen::Vector3d& p) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = p[static_cast<int>(k)];
      const double below = node.low[k] - x, above = x - node.high[k];
      const double out = below > above ? below : above;
      if (out > 0) sum += out * out;
    }
    return sum;
  }

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  std::vector<Eigen::Vector3d> points_;  ///< in the tree's order
};

}  // namespace ist
