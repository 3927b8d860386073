#include "spheres/point_tree.h"

#include <algorithm>
#include <numeric>

namespace ist {

PointTree::PointTree(const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) return;
  order_.resize(points.size());
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.reserve(points.size() / 2 + 2);
  nodes_.push_back({{}, {}, 0, static_cast<std::uint32_t>(points.size())});
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    Node node = nodes_[n];
    node.low.fill(std::numeric_limits<double>::infinity());
    node.high.fill(-std::numeric_limits<double>::infinity());
    for (std::uint32_t i = node.first; i < node.last; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = points[order_[i]][static_cast<int>(k)];
        node.low[k] = std::min(node.low[k], x);
        node.high[k] = std::max(node.high[k], x);
      }
    }
    if (node.last - node.first > kLeaf) {
      int axis = 0;
      double longest = -1;
      for (std::size_t k = 0; k < 3; ++k) {
        if (node.high[k] - node.low[k] > longest) {
          longest = node.high[k] - node.low[k];
          axis = static_cast<int>(k);
        }
      }
      const std::uint32_t middle = node.first + (node.last - node.first) / 2;
      std::nth_element(order_.begin() + node.first, order_.begin() + middle,
                       order_.begin() + node.last, [&](std::uint32_t a, std::uint32_t b) {
                         const double x = points[a][axis], y = points[b][axis];
                         return x < y || (x == y && a < b);
                       });
      node.left = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back({{}, {}, node.first, middle});
      nodes_.push_back({{}, {}, middle, node.last});
    }
    nodes_[n] = node;
  }
  points_.reserve(points.size());
  for (const std::uint32_t i : order_) points_.push_back(points[i]);
}

PointTree::Nearest PointTree::nearest(const Eigen::Vector3d& p, double limit2) const {
  Nearest best;
  best.distance2 = limit2;
  if (points_.empty()) return best;
  struct Entry {
    std::uint32_t node;
    double distance2;
  };
  std::array<Entry, kDeepest> stack;
  std::size_t top = 0;
  stack[top++] = {0, box_distance2(nodes_[0], p)};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.distance2 > best.distance2) continue;
    const Node& node = nodes_[entry.node];
    if (node.left != 0) {
      Entry near = {node.left, box_distance2(nodes_[node.left], p)};
      Entry far = {node.left + 1, box_distance2(nodes_[node.left + 1], p)};
      if (far.distance2 < near.distance2) std::swap(near, far);
      stack[top++] = far;
      stack[top++] = near;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.last; ++i) {
      const double d2 = (points_[i] - p).squaredNorm();
      if (d2 < best.distance2 ||
          (d2 == best.distance2 && order_[i] < best.index && best.index != UINT32_MAX)) {
        best.distance2 = d2;
        best.index = order_[i];
      }
    }
  }
  return best;
}

}  // namespace ist
