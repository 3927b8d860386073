#pragma once

#include <cstdint>

#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/geometry/mesh_view.h"

namespace ist {

/// Clears hit[i] where, seen along x, oriented box i is apart from a box.
inline void leave_out_apart(const OrientedBoxes<kBvhWidth>& boxes, const float low[3],
                            const float high[3], int hit[kBvhWidth]) {
  const float y = (low[1] + high[1]) / 2, z = (low[2] + high[2]) / 2;
  const float half_y = (high[1] - low[1]) / 2, half_z = (high[2] - low[2]) / 2;
  const auto size = [](FloatLanes x) { return x < FloatLanes{} ? -x : x; };
  for (int i = 0; i < kBvhWidth; i += kFloatLanes) {
    FloatLanes axis[3][3], centre_y{}, centre_z{}, apart{};
    load_axes(boxes, i, axis);
    for (int k = 0; k < 3; ++k) {
      const FloatLanes middle = load_lanes(boxes.middle[k] + i);
      centre_y += middle * axis[k][1];
      centre_z += middle * axis[k][2];
    }
    // Across each of the box's edges, as they are seen.
    for (int k = 0; k < 3; ++k) {
      const FloatLanes across_y = -axis[k][2], across_z = axis[k][1];
      FloatLanes reach =
          size(across_y) * half_y + size(across_z) * half_z + 8 * float_distance_error(1);
      for (int j = 0; j < 3; ++j)
        reach +=
            load_lanes(boxes.half[j] + i) * size(across_y * axis[j][1] + across_z * axis[j][2]);
      const FloatLanes off = size(across_y * (centre_y - y) + across_z * (centre_z - z)) - reach;
      apart = off > apart ? off : apart;
    }
    float gap[kFloatLanes];
    store_lanes(apart, gap);
    for (int lane = 0; lane < kFloatLanes; ++lane) hit[i + lane] &= gap[lane] > 0 ? 0 : 1;
  }
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
    if (mesh.oriented != nullptr) leave_out_apart(mesh.oriented[at], low, high, hit);
    for (int i = 0; i < kBvhWidth; ++i)
      if (hit[i] != 0) stack[top++] = node.child[i];
  }
  return true;
}

}  // namespace ist
