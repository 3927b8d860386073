#pragma once

#include <cmath>
#include <cstring>

#include "base/host_device.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/triangle_frame.h"

// Closest-point queries for host and device. The float answer is the minimum of one fixed formula
// (closest_in_frame over the blocks' frames) over *all* triangles, the smaller index among equals.
// It does not depend on the hierarchy or on the order of visits, so another hierarchy on another
// machine gives the same bits. Boxes are skipped only if no computed distance in them can count.

namespace ist {

/// Closest triangle by the float formula.
struct NearestTriangle {
  float distance2 = 0;                   ///< unit frame, squared
  std::uint32_t triangle = kNoTriangle;  ///< smallest index among equals
  float point[3] = {};                   ///< unit frame
};

constexpr int kBvhStackSize = 256;  ///< 3 entries a level, at most kBvhLevels (bvh_build.cpp)
constexpr int kBvhLevels = (kBvhStackSize - 1) / 3;

/// Bound on |float distance − exact distance| for a query no further than `reach` from the origin
/// (largest coordinate), the roundings of the query, the frames and the boxes included.
IST_HD inline float float_distance_error(float reach) { return (reach + 2.0f) * 0x1p-20f; }

/// The same for queries from p.
IST_HD inline float distance_error_at(const float p[3]) {
  float reach = 0;
  for (int k = 0; k < 3; ++k) {
    const float a = p[k] < 0 ? -p[k] : p[k];
    reach = a > reach ? a : reach;
  }
  return float_distance_error(reach);
}

/// Squared box distance beyond which no triangle can have a computed squared distance ≤ distance2.
IST_HD inline float prune_distance2(float distance2, float error) {
  const float reach = std::sqrt(distance2) * (1 + 0x1p-20f) + error;
  return reach * reach * (1 + 0x1p-20f);
}

#if defined(__GNUC__) && !defined(__CUDACC__)
using FloatLanes [[gnu::vector_size(4 * kBvhWidth)]] = float;  ///< SSE2 or NEON, no dispatch
#else
using FloatLanes = float;
#endif
constexpr int kFloatLanes = sizeof(FloatLanes) / sizeof(float);

template <class Lanes = FloatLanes>
IST_HD inline Lanes load_lanes(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}

IST_HD inline void store_lanes(FloatLanes lanes, float* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}

/// Squared distances from p to the children of a node.
IST_HD inline void child_distances2(const BvhNode& node, const float p[3],
                                    float distance2[kBvhWidth]) {
  for (int i = 0; i < kBvhWidth; i += kFloatLanes) {
    const FloatLanes zero{};
    FloatLanes sum = zero;
    for (int k = 0; k < 3; ++k) {
      const FloatLanes below = load_lanes(node.lower[k] + i) - p[k];
      const FloatLanes above = p[k] - load_lanes(node.upper[k] + i);
      const FloatLanes outside = below > above ? below : above;
      const FloatLanes gap = outside > zero ? outside : zero;
      sum += gap * gap;
    }
    store_lanes(sum, distance2 + i);
  }
}

/// The directions of the oriented boxes from `child` on, in three rows.
template <class Lanes, int kWidth>
IST_HD inline void load_axes(const OrientedBoxes<kWidth>& boxes, int child, Lanes axis[3][3]) {
  for (int k = 0; k < 3; ++k) {
    axis[0][k] = load_lanes<Lanes>(boxes.n[k] + child);
    axis[1][k] = load_lanes<Lanes>(boxes.u[k] + child);
  }
  cross3(axis[0], axis[1], axis[2]);
}

/// Squared distances from p to the oriented boxes from `child` on. Never above the exact ones:
/// twice the error of a float distance is subtracted for the roundings here and for directions that
/// are not quite orthogonal unit vectors.
template <class Lanes, int kWidth>
IST_HD inline Lanes oriented_distance2(const OrientedBoxes<kWidth>& boxes, int child,
                                       const float p[3], float error) {
  Lanes axis[3][3];
  load_axes(boxes, child, axis);
  const Lanes zero{};
  Lanes sum = zero;
  for (int k = 0; k < 3; ++k) {
    const Lanes off = axis[k][0] * p[0] + axis[k][1] * p[1] + axis[k][2] * p[2] -
                      load_lanes<Lanes>(boxes.middle[k] + child);
    const Lanes outside =
        (off < zero ? -off : off) - load_lanes<Lanes>(boxes.half[k] + child) - 2 * error;
    const Lanes gap = outside > zero ? outside : zero;
    sum += gap * gap;
  }
  return sum;
}

/// Closest points of a block's triangles, in their frames.
struct BlockPoints {
  float x[kBvhWidth];
  float y[kBvhWidth];
  float distance2[kBvhWidth];
};

IST_HD inline void block_points(const TriangleBlock& block, const float p[3], BlockPoints& points) {
  for (int i = 0; i < kBvhWidth; i += kFloatLanes) {
    const FloatLanes dx = p[0] - load_lanes(block.origin[0] + i);
    const FloatLanes dy = p[1] - load_lanes(block.origin[1] + i);
    const FloatLanes dz = p[2] - load_lanes(block.origin[2] + i);
    const auto along = [&](const float axis[3][kBvhWidth]) {
      return dx * load_lanes(axis[0] + i) + dy * load_lanes(axis[1] + i) +
             dz * load_lanes(axis[2] + i);
    };
    const FramePoint<FloatLanes> q = closest_in_frame(
        along(block.u), along(block.v), along(block.n), load_lanes(block.length + i),
        load_lanes(block.apex + i), load_lanes(block.height + i));
    store_lanes(q.x, points.x + i);
    store_lanes(q.y, points.y + i);
    store_lanes(q.distance2, points.distance2 + i);
  }
}

/// A triangle within reach of a query, passed to the visitor of for_triangles_near.
struct NearTriangle {
  FramePoint<float> closest;  ///< unit frame
  std::uint32_t triangle;
  const TriangleBlock* block;
  int lane;

  IST_HD void point(float out[3]) const {
    for (int k = 0; k < 3; ++k)
      out[k] =
          block->origin[k][lane] + (closest.x * block->u[k][lane] + closest.y * block->v[k][lane]);
  }
};

/// Visits triangles near p (unit frame), roughly the nearest first. `visit(NearTriangle)` returns
/// the new squared radius, never larger than before; radius2 keeps it. Every triangle whose float
/// distance² is ≤ the last radius is visited exactly once. Which others are visited, and in what
/// order, is unspecified.
template <class Visit>
IST_HD void for_triangles_near(const MeshView& mesh, const float p[3], float radius2,
                               Visit&& visit) {
  if (mesh.root == kBvhEmpty) return;
  const float error = distance_error_at(p);
  float bound = prune_distance2(radius2, error);
  std::uint32_t stack[kBvhStackSize];
  float stack_distance2[kBvhStackSize];
  int top = 0;
  std::uint32_t at = mesh.root;
  for (;;) {
    if ((at & kBvhLeaf) != 0) {
      const TriangleBlock& block = mesh.blocks[at & ~kBvhLeaf];
      BlockPoints points;
      block_points(block, p, points);
      for (int i = 0; i < kBvhWidth; ++i) {
        if (points.distance2[i] <= radius2 && block.triangle[i] != kNoTriangle) {
          radius2 = visit(NearTriangle{
              {points.x[i], points.y[i], points.distance2[i]}, block.triangle[i], &block, i});
          bound = prune_distance2(radius2, error);
        }
      }
    } else {
      const BvhNode& node = mesh.nodes[at];
      float d2[kBvhWidth];
      child_distances2(node, p, d2);
      if (mesh.oriented != nullptr)
        for (int i = 0; i < kBvhWidth; i += kFloatLanes) {
          const FloatLanes along_axes = load_lanes(d2 + i);
          const FloatLanes own = oriented_distance2<FloatLanes>(mesh.oriented[at], i, p, error);
          store_lanes(own > along_axes ? own : along_axes, d2 + i);
        }
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

/// The closest triangle of the mesh. `limit2`: squared distance beyond which triangles are ignored;
/// if none is that close, distance2 = limit2 and triangle = kNoTriangle.
IST_HD inline NearestTriangle nearest_triangle(const MeshView& mesh, const float p[3],
                                               float limit2 = 1e30f) {
  NearestTriangle best;
  best.distance2 = limit2;
  for_triangles_near(mesh, p, limit2, [&](const NearTriangle& near) {
    if (near.closest.distance2 < best.distance2 || near.triangle < best.triangle) {
      best.distance2 = near.closest.distance2;
      best.triangle = near.triangle;
      near.point(best.point);
    }
    return best.distance2;
  });
  return best;
}

}  // namespace ist
