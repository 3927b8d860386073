#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/mesh_view.h"
#include "mesh/wide_build.h"
#include "mesh/wide_tree.h"

namespace ist::testing {

/// A WideTree in host memory, built one triangle after the other. Its vertices are the mesh view's.
class HostWideTree {
 public:
  explicit HostWideTree(const MeshView& mesh) {
    Order order;
    for (std::uint32_t t = 0; t < mesh.triangle_count; ++t)
      order.emplace_back(curve_place(corners(mesh, t)), t);
    std::sort(order.begin(), order.end());

    tree_.triangle_count = mesh.triangle_count;
    tree_.vertex_count = mesh.vertex_count;
    tree_.vertices = mesh.vertices_exact;
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
      const std::uint32_t t = order[slot].second;
      write_lane(block, lane, mesh.vertices_exact, t, mesh.triangles + 3 * std::size_t{t});
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

 private:
  using Order = std::vector<std::pair<std::uint64_t, std::uint32_t>>;

  static WideOrientedBox oriented_box(const MeshView& mesh, const Order& order,
                                      std::uint32_t block) {
    const std::size_t begin = std::size_t{block} * kWideWidth;
    if (begin >= order.size()) return {};
    const std::size_t end = std::min(begin + kWideWidth, order.size());
    WideMoments moments;
    for (std::size_t i = begin; i < end; ++i)
      moments.add(corners(mesh, order[i].second), corners(mesh, order[begin].second).p[0]);
    WideOrientedBox box(moments);
    for (std::size_t i = begin; i < end; ++i)
      for (const double* corner : corners(mesh, order[i].second).p) box.extend(corner);
    return box;
  }

  static Corners corners(const MeshView& mesh, std::uint32_t triangle) {
    const std::uint32_t* t = mesh.triangles + 3 * std::size_t{triangle};
    const auto at = [&](int i) { return mesh.vertices_exact + 3 * std::size_t{t[i]}; };
    return {{at(0), at(1), at(2)}};
  }

  std::vector<WideNode> nodes_;
  std::vector<WideOriented> oriented_;
  std::vector<WideBlock> blocks_;
  WideTree tree_;
};

}  // namespace ist::testing
