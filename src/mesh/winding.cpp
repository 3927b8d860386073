#include "mesh/winding.h"

#include <algorithm>

#include "mesh/closest_point.h"
#include "mesh/ray_crossing.h"

namespace ist {
namespace {

/// Calls visit(triangle) for all triangles whose boxes meet the box.
template <class Visit>
void for_triangles_in(const MeshView& mesh, const RayBox& box, Visit&& visit) {
  if (mesh.root == kBvhEmpty) return;
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = mesh.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : mesh.blocks[at & ~kBvhLeaf].triangle)
        if (triangle != kNoTriangle) visit(triangle);
      continue;
    }
    const BvhNode& node = mesh.nodes[at];
    int hit[kBvhWidth] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < kBvhWidth; ++i)
        hit[i] &= (node.lower[k][i] <= box.upper[k]) & (node.upper[k][i] >= box.lower[k]);
    }
    for (int i = 0; i < kBvhWidth; ++i)
      if (hit[i] != 0) stack[top++] = node.child[i];
  }
}

}  // namespace

int winding_number(const MeshView& mesh, const double p[3]) {
  int winding = 0;
  for_triangles_in(mesh, RayBox::ray(p), [&](std::uint32_t triangle) {
    winding += ray_winding(corners_of(mesh, triangle), p);
  });
  return winding;
}

void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out) {
  out.clear();
  const double yz[2] = {y, z};
  for_triangles_in(mesh, RayBox::line(y, z), [&](std::uint32_t triangle) {
    const Corners t = corners_of(mesh, triangle);
    const int facing = pierced(t, yz);
    if (facing != 0) out.push_back({crossing_x(t, yz), -facing});
  });
  std::sort(out.begin(), out.end(), [](const Crossing& a, const Crossing& b) {
    return a.x != b.x ? a.x < b.x : a.sign > b.sign;
  });
}

}  // namespace ist
