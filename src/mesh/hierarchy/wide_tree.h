#pragma once

#include "base/host_device.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/triangle_frame.h"

// A mesh in the form that the GPU queries: a hierarchy without pointers, as wide as a warp, over
// triangles ordered so that successive ones are close together
// (cuda/packing/mesh/triangle_order.cu). Node 0 is the root, and the children of node i are the
// nodes 32 i + 1 … 32 i + 32; from `first_leaf` on the numbers denote blocks of 32 triangles. No
// answer depends on the order of the triangles, so answers equal those of the CPU's hierarchy, bit
// for bit.

namespace ist {

constexpr int kWideWidth = 32;
constexpr int kWideDepth = 5;  ///< levels of nodes for 2^30 triangles

/// 32 child boxes side by side, rounded outward: they contain the exact and the float vertices. The
/// box of a missing child is empty: lower = ∞, upper = −∞.
struct alignas(128) WideNode {
  float lower[3][kWideWidth];
  float upper[3][kWideWidth];
};

/// The blocks' boxes for the nodes of the last level. half = −∞ if there is no block.
using WideOriented = OrientedBoxes<kWideWidth>;

/// 32 triangle frames side by side, computed in double from the exact vertices and rounded once, as
/// in TriangleBlock. Lanes beyond the last triangle are at 1e18 and have kNoTriangle.
struct alignas(128) WideBlock {
  float origin[3][kWideWidth];
  float u[3][kWideWidth], v[3][kWideWidth], n[3][kWideWidth];
  float length[kWideWidth], apex[kWideWidth], height[kWideWidth];
  std::uint32_t triangle[kWideWidth];   ///< index in the mesh
  std::uint32_t corner[3][kWideWidth];  ///< vertex indices
};

/// Plain arrays in host or device memory. A triangle's *slot* is 32 · block + lane.
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

/// Number of the first node of level `depth`; the root's level is 0.
IST_HD constexpr std::uint32_t first_wide_node(int depth) {
  std::uint32_t first = 0;
  for (int i = 0; i < depth; ++i) first = kWideWidth * first + 1;
  return first;
}

/// Number of levels of nodes over so many blocks; at least one.
IST_HD constexpr int wide_depth(std::uint32_t block_count) {
  int depth = 1;
  for (std::uint64_t reach = kWideWidth; reach < block_count; reach *= kWideWidth) ++depth;
  return depth;
}

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

/// The children of a node that are still to be visited: a key for each, spread over the team's
/// lanes, with the child's number in its low five bits.
template <class Team>
struct WideKeys {
  static constexpr int kEach = kWideWidth / Team::kWidth;
  static constexpr std::uint32_t kVisited = 0xFFFFFFFFu;
  static constexpr std::uint32_t kChild = kWideWidth - 1;  ///< the bits of a child's number
  std::uint32_t key[kEach];

  IST_HD void set(const Team& team, int i, std::uint32_t urgency) {
    key[i] = (urgency & ~kChild) | static_cast<std::uint32_t>(team.lane() + i * Team::kWidth);
  }

  /// Returns the least key and marks it as visited; kVisited if none is below the limit.
  IST_HD std::uint32_t take_first(const Team& team, std::uint32_t limit) {
    std::uint32_t first = kVisited;
    for (int i = 0; i < kEach; ++i) first = key[i] < first ? key[i] : first;
    first = team.min(first);
    if ((first & ~kChild) >= limit) return kVisited;
    for (int i = 0; i < kEach; ++i)
      if (key[i] == first) key[i] = kVisited;
    return first;
  }
};

/// Descends the tree, nearest children first, with all lanes of the team together. The query
/// provides
///   key(node, child)  the child's position in the order; its low five bits are ignored
///   limit()           keys that are not below it are skipped; the same in all lanes
///   visit(block)      called with the index of a block of triangles; may lower the limit, 0 ends
/// The path is kept in registers: a visit costs one dependent load a level. (Visiting blocks in
/// pairs, so that their loads overlap, makes a single query 15 % faster and many at once 20 %
/// slower.)
template <class Team, class Query>
IST_HD void traverse(const Team& team, const WideTree& tree, Query&& query) {
  using Keys = WideKeys<Team>;
  if (tree.block_count == 0) return;
  Keys here{}, above[kWideDepth - 1] = {};
  std::uint32_t node = 0;
  for (int i = 0; i < Keys::kEach; ++i)
    here.set(team, i, query.key(0, team.lane() + i * Team::kWidth));
  for (;;) {
    const std::uint32_t first = here.take_first(team, query.limit());
    if (first == Keys::kVisited) {  // nothing left at this node
      if (node == 0) return;
      node = (node - 1) / kWideWidth;
      here = above[0];
      for (int d = 0; d + 2 < kWideDepth; ++d) above[d] = above[d + 1];
      continue;
    }
    const std::uint32_t children = kWideWidth * node + 1;
    if (children >= tree.first_leaf) {
      query.visit(children + (first & Keys::kChild) - tree.first_leaf);
      continue;
    }
    for (int d = kWideDepth - 2; d > 0; --d) above[d] = above[d - 1];
    above[0] = here;
    node = children + (first & Keys::kChild);
    for (int i = 0; i < Keys::kEach; ++i)
      here.set(team, i, query.key(node, team.lane() + i * Team::kWidth));
  }
}

}  // namespace ist
