#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "mesh/geometry/mesh_view.h"
#include "mesh/hierarchy/wide_build.h"
#include "mesh/hierarchy/wide_tree.h"

namespace ist::testing {

/// A WideTree in host memory, built one triangle after the other. Its vertices are the mesh view's.
class HostWideTree {
 public:
  using Order = std::vector<std::uint32_t>;

  /// Over triangles in an order of its own: cut in halves across the longest side.
  explicit HostWideTree(const MeshView& mesh) : HostWideTree(mesh, halved(mesh)) {}

  HostWideTree(const MeshView& mesh, const Order& order) {
    tree_.triangle_count = mesh.triangle_count;
    tree_.vertex_count = mesh.vertex_count;
    tree_.vertices = mesh.vertices;
    tree_.block_count = (mesh.triangle_count + kWideWidth - 1) / kWideWidth;
    const int depth = wide_depth(tree_.block_count);
    tree_.first_leaf = first_wide_node(depth);
    blocks_.resize(tree_.block_count);
    nodes_.resize(tree_.first_leaf);
    for (WideNode& node : nodes_)
      for (int child = 0; child < kWideWidth; ++child) WideBox().write_to(node, child);

    oriented_.resize((tree_.block_count + kWideWidth - 1) / kWideWidth);
    for (std::uint32_t block = 0; block < oriented_.size() * kWideWidth; ++block)
      oriented_box(mesh, order, block)
          .write_to(oriented_[block / kWideWidth], static_cast<int>(block % kWideWidth));

    std::vector<WideBox> boxes(tree_.block_count);
    for (std::uint32_t slot = 0; slot < tree_.block_count * kWideWidth; ++slot) {
      WideBlock& block = blocks_[slot / kWideWidth];
      const int lane = static_cast<int>(slot % kWideWidth);
      if (slot >= order.size()) {
        write_lane(block, lane, nullptr, kNoTriangle, nullptr);
        continue;
      }
      const std::uint32_t t = order[slot];
      write_lane(block, lane, mesh.vertices, t, mesh.triangles + 3 * std::size_t{t});
      for (const double* corner : corners(mesh, t).p) boxes[slot / kWideWidth].extend(corner);
    }
    std::uint32_t first = tree_.first_leaf;
    for (int level = depth - 1; level >= 0; --level) {
      first = first_wide_node(level);
      std::vector<WideBox> parents((boxes.size() + kWideWidth - 1) / kWideWidth);
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        boxes[i].write_to(nodes_[first + i / kWideWidth], static_cast<int>(i % kWideWidth));
        WideBox& parent = parents[i / kWideWidth];
        for (int k = 0; k < 3; ++k) {
          parent.lower[k] = std::min(parent.lower[k], boxes[i].lower[k]);
          parent.upper[k] = std::max(parent.upper[k], boxes[i].upper[k]);
        }
      }
      boxes = std::move(parents);
    }
    tree_.blocks = blocks_.data();
    tree_.nodes = nodes_.data();
    tree_.oriented = oriented_.data();
  }

  const WideTree& tree() const { return tree_; }

  /// Sum of the surfaces of the blocks' boxes, halved.
  double area_of_boxes() const {
    double sum = 0;
    for (std::uint32_t b = 0; b < tree_.block_count; ++b) {
      const WideNode& node = nodes_[(tree_.first_leaf + b - 1) / kWideWidth];
      Eigen::Vector3d side;
      for (int k = 0; k < 3; ++k)
        side[k] = double(node.upper[k][b % kWideWidth]) - node.lower[k][b % kWideWidth];
      sum += side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
    }
    return sum;
  }

 private:
  static Order halved(const MeshView& mesh) {
    Order order(mesh.triangle_count);
    std::iota(order.begin(), order.end(), 0u);
    halve(mesh, order, std::bit_ceil(mesh.triangle_count));
    return order;
  }

  /// Cuts the triangles across the longest side of the box of their first corners, and so on.
  static void halve(const MeshView& mesh, std::span<std::uint32_t> order, std::size_t size) {
    if (size <= kWideWidth || order.empty()) return;
    Eigen::AlignedBox3d box;
    const auto corner = [&](std::uint32_t t) {
      return Eigen::Vector3d::Map(corners(mesh, t).p[0]);
    };
    for (const std::uint32_t t : order) box.extend(corner(t));
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t half = std::min(size / 2, order.size());
    std::nth_element(
        order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
        [&](std::uint32_t a, std::uint32_t b) { return corner(a)[axis] < corner(b)[axis]; });
    halve(mesh, order.first(half), size / 2);
    halve(mesh, order.subspan(half), size / 2);
  }

  static WideOrientedBox oriented_box(const MeshView& mesh, const Order& order,
                                      std::uint32_t block) {
    const std::size_t begin = std::size_t{block} * kWideWidth;
    if (begin >= order.size()) return {};
    const std::size_t end = std::min(begin + kWideWidth, order.size());
    WideMoments moments;
    for (std::size_t i = begin; i < end; ++i)
      moments.add(corners(mesh, order[i]), corners(mesh, order[begin]).p[0]);
    WideOrientedBox box(moments);
    for (std::size_t i = begin; i < end; ++i)
      for (const double* corner : corners(mesh, order[i]).p) box.extend(corner);
    return box;
  }

  static Corners corners(const MeshView& mesh, std::uint32_t triangle) {
    const std::uint32_t* t = mesh.triangles + 3 * std::size_t{triangle};
    const auto at = [&](int i) { return mesh.vertices + 3 * std::size_t{t[i]}; };
    return {{at(0), at(1), at(2)}};
  }

  std::vector<WideNode> nodes_;
  std::vector<WideOriented> oriented_;
  std::vector<WideBlock> blocks_;
  WideTree tree_;
};

}  // namespace ist::testing
