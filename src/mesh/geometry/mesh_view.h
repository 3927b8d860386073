#pragma once

#include <cstdint>

namespace ist {

constexpr int kBvhWidth = 4;                      ///< children of a node, triangles of a block
constexpr std::uint32_t kBvhLeaf = 0x80000000u;   ///< flag of a child that is a triangle block
constexpr std::uint32_t kBvhEmpty = 0xFFFFFFFFu;  ///< marks a missing child
constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFu;

/// Four child boxes of a bounding volume hierarchy. The boxes contain the exact and the float
/// vertices (rounded outward); an absent child has an empty, infinitely far box.
struct alignas(64) BvhNode {
  float lower[3][kBvhWidth];
  float upper[3][kBvhWidth];
  std::uint32_t child[kBvhWidth];  ///< node index, kBvhLeaf | block index, or kBvhEmpty
};

/// Oriented boxes of a node's children, side by side: the points x with |a · x − middle[k]| ≤
/// half[k] for a = n, u, n × u. A patch of a curved surface is flat, but seldom flat along the
/// axes, and a needle is thin.
template <int kWidth>
struct alignas(4 * kWidth) OrientedBoxes {
  float n[3][kWidth], u[3][kWidth];
  float middle[3][kWidth];
  float half[3][kWidth];
};

/// Up to four TriangleFrame<float>s side by side, computed in double from the exact vertices and
/// rounded once. Absent ones are at 1e18 and have kNoTriangle.
struct alignas(64) TriangleBlock {
  float origin[3][kBvhWidth];
  float u[3][kBvhWidth], v[3][kBvhWidth], n[3][kBvhWidth];
  float length[kBvhWidth], apex[kBvhWidth], height[kBvhWidth];
  std::uint32_t triangle[kBvhWidth];
};

/// Plain arrays of a mesh in its unit frame, for host and device code. Owned by MeshSolid.
struct MeshView {
  const double* vertices = nullptr;          ///< double[3 · vertex_count], unit frame
  const std::uint32_t* triangles = nullptr;  ///< uint32[3 · triangle_count]
  std::uint32_t vertex_count = 0;
  std::uint32_t triangle_count = 0;

  const BvhNode* nodes = nullptr;
  const TriangleBlock* blocks = nullptr;
  std::uint32_t root = kBvhEmpty;                      ///< coded like BvhNode::child
  const OrientedBoxes<kBvhWidth>* oriented = nullptr;  ///< one for each node, or none
};

/// A point where a line parallel to x pierces the surface.
struct Crossing {
  double x = 0;  ///< unit frame
  int sign = 0;  ///< +1: the winding number rises by one towards +x; −1: falls
};

}  // namespace ist
