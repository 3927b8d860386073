#pragma once

#include <cmath>
#include <cstdint>

#include "mesh/host_device.h"
#include "mesh/mesh_view.h"
#include "mesh/triangle_frame.h"

// Closest-point queries for host and device. The float answer is the minimum of one fixed formula
// (closest_in_frame over the blocks' frames) over *all* triangles, the smaller index among equals:
// it does not depend on the hierarchy or on the order of visits, so another hierarchy on another
// machine gives the same bits. Boxes are skipped only where no computed distance in them can count.

namespace ist {

/// Closest triangle by the float formula.
struct NearestTriangle {
  float distance2 = 0;                   ///< unit frame, squared
  std::uint32_t triangle = kNoTriangle;  ///< smallest index among equals
  float point[3] = {};                   ///< unit frame
};

constexpr int kBvhStackSize = 256;  ///< 3 entries a level, at most 72 levels (bvh_build.cpp)

/// Bound on |float distance − exact distance| for a query no further than `reach` from the origin
/// (largest coordinate), the roundings of the query, the frames and the boxes included.
IST_HD inline float float_distance_error(float reach) { return (reach + 2.0f) * 0x1p-20f; }

/// Squared box distance beyond which no triangle can have a computed squared distance ≤ distance2.
IST_HD inline float prune_distance2(float distance2, float error) {
  const float reach = std::sqrt(distance2) * (1 + 0x1p-20f) + error;
  return reach * reach * (1 + 0x1p-20f);
}

/// Squared distances from p to the four children of a node.
IST_HD inline void child_distances2(const BvhNode& node, const float p[3],
                                    float distance2[kBvhWidth]) {
  for (int i = 0; i < kBvhWidth; ++i) distance2[i] = 0;
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < kBvhWidth; ++i) {
      const float below = node.lower[k][i] - p[k];
      const float above = p[k] - node.upper[k][i];
      float gap = below > above ? below : above;
      gap = gap > 0 ? gap : 0;
      distance2[i] += gap * gap;
    }
  }
}

/// The closest points of a block's triangles, lane by lane.
IST_HD inline void block_points(const TriangleBlock& block, const float p[3],
                                FramePoint<float> points[kBvhWidth]) {
  float px[kBvhWidth], py[kBvhWidth], d2[kBvhWidth];
  for (int i = 0; i < kBvhWidth; ++i) {
    const float dx = p[0] - block.origin[0][i];
    const float dy = p[1] - block.origin[1][i];
    const float dz = p[2] - block.origin[2][i];
    const float x = dx * block.u[0][i] + dy * block.u[1][i] + dz * block.u[2][i];
    const float y = dx * block.v[0][i] + dy * block.v[1][i] + dz * block.v[2][i];
    const float z = dx * block.n[0][i] + dy * block.n[1][i] + dz * block.n[2][i];
    const FramePoint<float> q =
        closest_in_frame(x, y, z, block.length[i], block.apex[i], block.height[i]);
    px[i] = q.x;
    py[i] = q.y;
    d2[i] = q.distance2;
  }
  for (int i = 0; i < kBvhWidth; ++i) points[i] = {px[i], py[i], d2[i]};
}

/// A triangle within reach of a query, as the visitor of for_triangles_near gets it.
struct NearTriangle {
  std::uint32_t triangle;
  float distance2;  ///< unit frame, squared; by the float formula
  FramePoint<float> in_frame;
  const TriangleBlock* block;
  int lane;

  IST_HD void point(float out[3]) const {
    for (int k = 0; k < 3; ++k)
      out[k] = block->origin[k][lane] +
               (in_frame.x * block->u[k][lane] + in_frame.y * block->v[k][lane]);
  }
};

/// Visits triangles near p (unit frame), near ones first by tendency. `visit(NearTriangle)` returns
/// the new squared radius (never larger than before; radius2 to go on as it was). Every triangle
/// whose float distance² is ≤ the last radius is visited exactly once; which others are, and in
/// what order, is not specified.
template <class Visit>
IST_HD void for_triangles_near(const MeshView& mesh, const float p[3], float radius2,
                               Visit&& visit) {
  if (mesh.root == kBvhEmpty) return;
  float reach = 0;
  for (int k = 0; k < 3; ++k) {
    const float a = p[k] < 0 ? -p[k] : p[k];
    reach = a > reach ? a : reach;
  }
  const float error = float_distance_error(reach);
  float bound = prune_distance2(radius2, error);
  std::uint32_t stack[kBvhStackSize];
  float stack_distance2[kBvhStackSize];
  int top = 0;
  std::uint32_t at = mesh.root;
  for (;;) {
    if ((at & kBvhLeaf) != 0) {
      const TriangleBlock& block = mesh.blocks[at & ~kBvhLeaf];
      FramePoint<float> points[kBvhWidth];
      block_points(block, p, points);
      for (int i = 0; i < kBvhWidth; ++i) {
        if (points[i].distance2 <= radius2 && block.triangle[i] != kNoTriangle) {
          radius2 =
              visit(NearTriangle{block.triangle[i], points[i].distance2, points[i], &block, i});
          bound = prune_distance2(radius2, error);
        }
      }
    } else {
      const BvhNode& node = mesh.nodes[at];
      float d2[kBvhWidth];
      child_distances2(node, p, d2);
      const int base = top;
      for (int i = 0; i < kBvhWidth; ++i) {
        if (!(d2[i] <= bound) || node.child[i] == kBvhEmpty) continue;
        int place = top++;
        for (; place > base && stack_distance2[place - 1] < d2[i]; --place) {
          stack[place] = stack[place - 1];
          stack_distance2[place] = stack_distance2[place - 1];
        }
        stack[place] = node.child[i];
        stack_distance2[place] = d2[i];
      }
    }
    do {
      if (top == 0) return;
      --top;
    } while (stack_distance2[top] > bound);
    at = stack[top];
  }
}

/// The closest triangle of the mesh. `limit2`: squared distance beyond which nothing is of
/// interest; where no triangle is that close, distance2 = limit2 and triangle = kNoTriangle.
IST_HD inline NearestTriangle nearest_triangle(const MeshView& mesh, const float p[3],
                                               float limit2 = 1e30f) {
  NearestTriangle best;
  best.distance2 = limit2;
  for_triangles_near(mesh, p, limit2, [&](const NearTriangle& near) {
    if (near.distance2 < best.distance2 || near.triangle < best.triangle) {
      best.distance2 = near.distance2;
      best.triangle = near.triangle;
      near.point(best.point);
    }
    return best.distance2;
  });
  return best;
}

}  // namespace ist
