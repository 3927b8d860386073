#pragma once

#include <cstdint>

#include "mesh/closest_point.h"
#include "mesh/exact_triangle.h"
#include "mesh/mesh_view.h"

namespace ist {

/// Whether the box around a triangle meets another.
inline bool box_meets(const Corners& t, const float low[3], const float high[3]) {
  for (int k = 0; k < 3; ++k) {
    if (t.p[0][k] < low[k] && t.p[1][k] < low[k] && t.p[2][k] < low[k]) return false;
    if (t.p[0][k] > high[k] && t.p[1][k] > high[k] && t.p[2][k] > high[k]) return false;
  }
  return true;
}

/// Calls is(corners) for all triangles whose boxes meet a box, and for some others, until one is
/// so: whether none was.
template <class Is>
bool none_about_box(const MeshView& mesh, const float low[3], const float high[3], const Is& is) {
  if (mesh.root == kBvhEmpty) return true;
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = mesh.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : mesh.blocks[at & ~kBvhLeaf].triangle)
        if (triangle != kNoTriangle && is(corners_of(mesh, triangle))) return false;
      continue;
    }
    const BvhNode& node = mesh.nodes[at];
    int hit[kBvhWidth] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < kBvhWidth; ++i)
        hit[i] &= (node.lower[k][i] <= high[k]) & (node.upper[k][i] >= low[k]);
    for (int i = 0; i < kBvhWidth; ++i)
      if (hit[i] != 0) stack[top++] = node.child[i];
  }
  return true;
}

/// Asks those alone whose boxes meet the box: the hierarchy has no say in it.
template <class Is>
bool none_in_box(const MeshView& mesh, const float low[3], const float high[3], const Is& is) {
  return none_about_box(mesh, low, high, [&](const Corners& triangle) {
    return box_meets(triangle, low, high) && is(triangle);
  });
}

}  // namespace ist
