#pragma once

#include "base/host_device.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/triangle_frame.h"

// A mesh as the GPU asks it: a hierarchy without pointers, as wide as a warp, over triangles
// ordered so that successive ones lie close together (cuda/packing/mesh/triangle_order.h). Node 0
// is the root and the children of node i are the nodes 32 i + 1 … 32 i + 32; from `first_leaf` on
// the numbers mean blocks of 32 triangles. No query's answer depends on the order of the triangles,
// so they are those of the CPU's hierarchy, bit for bit.

namespace ist {

constexpr int kWideWidth = 32;
constexpr int kWideDepth = 5;  ///< levels of nodes for 2^30 triangles

/// 32 child boxes side by side, rounded outward: they contain the exact and the float vertices. The
/// box of a child that is not there is empty: lower = ∞, upper = −∞.
struct alignas(128) WideNode {
  float lower[3][kWideWidth];
  float upper[3][kWideWidth];
};

/// The blocks' boxes for the nodes of the last level. half = −∞ where there is no block.
using WideOriented = OrientedBoxes<kWideWidth>;

/// 32 triangles side by side, their frames made in double from the exact vertices and rounded once,
/// as in TriangleBlock. Lanes beyond the last triangle lie at 1e18 and carry kNoTriangle.
struct alignas(128) WideBlock {
  float origin[3][kWideWidth];
  float u[3][kWideWidth], v[3][kWideWidth], n[3][kWideWidth];
  float length[kWideWidth], apex[kWideWidth], height[kWideWidth];
  std::uint32_t triangle[kWideWidth];   ///< index in the mesh
  std::uint32_t corner[3][kWideWidth];  ///< vertex indices
};

/// Plain arrays, in the memory of whoever asks. A triangle's *slot* is 32 · block + lane.
struct WideTree {
  const WideNode* nodes = nullptr;
  const WideOriented* oriented = nullptr;  ///< one for each node from last_level() on
  const WideBlock* blocks = nullptr;
  const double* vertices = nullptr;  ///< double[3 · vertex_count], unit frame
  std::uint32_t first_leaf = 0;      ///< number of nodes, gaps included
  std::uint32_t block_count = 0;
  std::uint32_t triangle_count = 0;
  std::uint32_t vertex_count = 0;

  IST_HD const WideNode& node(std::uint32_t i) const { return in_global_memory(nodes)[i]; }
  IST_HD const WideOriented& oriented_node(std::uint32_t i) const {
    return in_global_memory(oriented)[i - last_level()];
  }
  IST_HD const WideBlock& block(std::uint32_t i) const { return in_global_memory(blocks)[i]; }
  IST_HD const double* vertex(std::uint32_t i) const {
    return in_global_memory(vertices) + 3 * std::size_t{i};
  }

  /// The first of the nodes whose children are blocks.
  IST_HD std::uint32_t last_level() const { return (first_leaf - 1) / kWideWidth; }
};

constexpr std::uint32_t kNoSlot = 0xFFFFFFFFu;

/// Number of the first node of level `depth`, 0 being the root's.
IST_HD constexpr std::uint32_t first_wide_node(int depth) {
  std::uint32_t first = 0;
  for (int i = 0; i < depth; ++i) first = kWideWidth * first + 1;
  return first;
}

/// Levels of nodes over so many blocks; at least one.
IST_HD constexpr int wide_depth(std::uint32_t block_count) {
  int depth = 1;
  for (std::uint64_t reach = kWideWidth; reach < block_count; reach *= kWideWidth) ++depth;
  return depth;
}

/// The float frame of the triangle in a slot.
IST_HD inline TriangleFrame<float> frame_in(const WideBlock& block, int lane) {
  TriangleFrame<float> f;
  for (int k = 0; k < 3; ++k) {
    f.origin[k] = block.origin[k][lane];
    f.u[k] = block.u[k][lane];
    f.v[k] = block.v[k][lane];
    f.n[k] = block.n[k][lane];
  }
  f.length = block.length[lane];
  f.apex = block.apex[lane];
  f.height = block.height[lane];
  return f;
}

IST_HD inline TriangleFrame<float> frame_in(const WideTree& tree, std::uint32_t slot) {
  return frame_in(tree.block(slot / kWideWidth), static_cast<int>(slot % kWideWidth));
}

/// Index in the mesh of the triangle in a slot.
IST_HD inline std::uint32_t triangle_in(const WideTree& tree, std::uint32_t slot) {
  return tree.block(slot / kWideWidth).triangle[slot % kWideWidth];
}

}  // namespace ist
