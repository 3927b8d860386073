#pragma once

#include "mesh/closest_point.h"
#include "mesh/mesh_solid.h"
#include "packing/constraint.h"
#include "packing/ring.h"

namespace ist::packing {

/// The surface of a mesh, as packing asks it. Features are triangles, named by their place in the
/// hierarchy's blocks; which triangle is nearest does not depend on the hierarchy.
class MeshSurface {
 public:
  using Feature = std::uint32_t;

  explicit MeshSurface(const MeshSolid& solid) : solid_(solid), view_(solid.view()) {}

  /// Unsigned distance to the surface, and the feature there, if it is less than `limit`.
  bool nearest(Float3 x, float limit, Feature& feature, float& distance) const {
    const float p[3] = {x.x, x.y, x.z};
    float best2 = limit * limit;
    std::uint32_t best = kNoTriangle;
    for_triangles_near(view_, p, best2, [&](const NearTriangle& near) {
      if (near.closest.distance2 < best2 ||
          (near.closest.distance2 == best2 && near.triangle < best)) {
        best2 = near.closest.distance2;
        best = near.triangle;
        feature = static_cast<std::uint32_t>(near.block - view_.blocks) * kBvhWidth +
                  static_cast<std::uint32_t>(near.lane);
      }
      return best2;
    });
    distance = std::sqrt(best2);
    return best != kNoTriangle;
  }

  /// Constraints at x of remembered features, `count` ≤ Ring::kCapacity.
  void constraints(const Feature* features, int count, Float3 x, Constraint* out) const {
    constexpr int kMost = Ring<Feature>::kCapacity;
    float dx[kMost], dy[kMost], dz[kMost], d2[kMost];
    for (int i = 0; i < count; ++i) {
      const TriangleBlock& b = view_.blocks[features[i] / kBvhWidth];
      const int lane = static_cast<int>(features[i] % kBvhWidth);
      const Float3 o{b.origin[0][lane], b.origin[1][lane], b.origin[2][lane]};
      const Float3 u{b.u[0][lane], b.u[1][lane], b.u[2][lane]};
      const Float3 v{b.v[0][lane], b.v[1][lane], b.v[2][lane]};
      const Float3 n{b.n[0][lane], b.n[1][lane], b.n[2][lane]};
      const Float3 d = x - o;
      const float along_u = dot(d, u), along_v = dot(d, v), along_n = dot(d, n);
      const FramePoint<float> q =
          closest_in_frame(along_u, along_v, along_n, b.length[lane], b.apex[lane], b.height[lane]);
      const Float3 away = (along_u - q.x) * u + (along_v - q.y) * v + along_n * n;
      dx[i] = away.x;
      dy[i] = away.y;
      dz[i] = away.z;
      d2[i] = q.distance2;
    }
    for (int i = 0; i < count; ++i) {
      const float distance = std::sqrt(d2[i]);
      const float inverse = distance > 0 ? 1 / distance : 0;
      out[i] = {{inverse * dx[i], inverse * dy[i], inverse * dz[i]}, distance, 0.5f * inverse};
      if (!(distance > 0)) out[i].curvature = 1e30f;
    }
  }

  /// Where the solid is locally an intersection of half-spaces, its faces' planes bound the
  /// clearance in a whole cell, however large the cell is next to its distance from them. Let S be
  /// all triangles within 3h of x. If each lies on the inner side of every other one's plane, the
  /// surface being closed, the solid near x is the intersection P of the half-spaces of S: beyond
  /// one of them there is none of it, and from a point of P within h of x the way straight to a
  /// plane no further than h from x meets the surface before that plane. Writes these planes as
  /// constraints; returns how many, 0 if S is not so or too large.
  int convex_planes(Float3 x, float h, bool x_inside, Constraint* out, int capacity) const {
    constexpr int kMost = 32;
    constexpr float kTolerance = 4e-7f;  // rounding of the frames
    Float3 corner[kMost][3], normal[kMost];
    int count = 0;
    bool convex = true;
    const float p[3] = {x.x, x.y, x.z};
    const float radius2 = 9 * h * h;
    for_triangles_near(view_, p, radius2, [&](const NearTriangle& near) {
      const TriangleBlock& b = *near.block;
      const int lane = near.lane;
      if (count == kMost || !(b.height[lane] > 1e-9f * b.length[lane])) convex = false;
      if (!convex) return 0.0f;
      const Float3 o{b.origin[0][lane], b.origin[1][lane], b.origin[2][lane]};
      const Float3 u{b.u[0][lane], b.u[1][lane], b.u[2][lane]};
      const Float3 v{b.v[0][lane], b.v[1][lane], b.v[2][lane]};
      corner[count][0] = o;
      corner[count][1] = o + b.length[lane] * u;
      corner[count][2] = o + b.apex[lane] * u + b.height[lane] * v;
      normal[count] = -1.0f * Float3{b.n[0][lane], b.n[1][lane], b.n[2][lane]};
      ++count;
      return radius2;
    });
    for (int i = 0; i < count && convex; ++i)
      for (int j = 0; j < count && convex; ++j)
        for (int k = 0; k < 3; ++k)
          convex = convex && dot(normal[i], corner[j][k] - corner[i][0]) >= -kTolerance;
    if (!convex || (x_inside && solid_.winding_number(exact(x)) != 1)) return 0;
    int written = 0;
    for (int i = 0; i < count && written < capacity; ++i) {
      const float distance = dot(normal[i], x - corner[i][0]);
      if (distance < h) out[written++] = {normal[i], distance + kTolerance, 0};
    }
    return written;
  }

  bool inside(Float3 x) const { return solid_.inside(exact(x)); }

  /// Exact clearance of a point for certification: distance to the surface, negative outside.
  double clearance(Float3 x) const {
    return solid_.inside(exact(x)) ? solid_.closest_point(exact(x)).distance : -1.0;
  }

 private:
  static Eigen::Vector3d exact(Float3 x) { return {x.x, x.y, x.z}; }

  const MeshSolid& solid_;
  const MeshView& view_;
};

}  // namespace ist::packing
