#pragma once

#include <cstdint>

#include "mesh/closest_point.h"
#include "mesh/exact_triangle.h"
#include "mesh/mesh_view.h"

namespace ist {

/// Calls visit(corners) for the triangles in leaves that meet a box until one returns false:
/// whether none did.
template <class Is>
bool none_in_box(const MeshView& surface, const float low[3], const float high[3], const Is& is) {
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = surface.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : surface.blocks[at & ~kBvhLeaf].triangle)
        if (triangle != kNoTriangle && is(corners_of(surface, triangle))) return false;
      continue;
    }
    const BvhNode& node = surface.nodes[at];
    int hit[kBvhWidth] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < kBvhWidth; ++i)
        hit[i] &= (node.lower[k][i] <= high[k]) & (node.upper[k][i] >= low[k]);
    for (int i = 0; i < kBvhWidth; ++i)
      if (hit[i] != 0 && node.child[i] != kBvhEmpty) stack[top++] = node.child[i];
  }
  return true;
}

}  // namespace ist
