#pragma once

#include "mesh/closest_point.h"
#include "mesh/mesh_solid.h"
#include "packing/constraint.h"
#include "packing/ring.h"

namespace ist::packing {

/// Closest point to x of the triangle abc, in float. Ericson, Real-Time Collision Detection 5.1.5.
IST_HD inline Float3 closest_on_triangle(Float3 x, Float3 a, Float3 b, Float3 c) {
  const Float3 ab = b - a, ac = c - a, ax = x - a;
  const float d1 = dot(ab, ax), d2 = dot(ac, ax);
  if (d1 <= 0 && d2 <= 0) return a;
  const Float3 bx = x - b;
  const float d3 = dot(ab, bx), d4 = dot(ac, bx);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + (d1 / (d1 - d3)) * ab;
  const Float3 cx = x - c;
  const float d5 = dot(ab, cx), d6 = dot(ac, cx);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + (d2 / (d2 - d6)) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b);
  const float inverse = 1 / (va + vb + vc);
  return a + (vb * inverse) * ab + (vc * inverse) * ac;
}

/// The surface of a mesh, as packing asks it: features are triangles.
class MeshSurface {
 public:
  using Feature = std::uint32_t;

  explicit MeshSurface(const MeshSolid& solid) : solid_(solid), view_(solid.view()) {}

  /// Unsigned distance to the surface, and the feature there, if it is less than `limit`.
  bool nearest(Float3 x, float limit, Feature& feature, float& distance) const {
    const float p[3] = {x.x, x.y, x.z};
    const NearestTriangle found = nearest_triangle(view_, p, limit * limit);
    if (found.triangle == kNoTriangle || !(found.distance2 < limit * limit)) return false;
    feature = found.triangle;
    distance = sqrtf(found.distance2);
    return true;
  }

  /// A remembered feature seen from x.
  Constraint at(Feature triangle, Float3 x) const {
    const std::uint32_t* corner = view_.triangles + 3 * std::size_t{triangle};
    return ball_constraint(
        closest_on_triangle(x, vertex(corner[0]), vertex(corner[1]), vertex(corner[2])), 0, x);
  }

  bool inside(Float3 x) const { return solid_.inside(exact(x)); }

  /// Exact clearance of a point for certification: distance to the surface, negative outside.
  double clearance(Float3 x) const {
    return solid_.inside(exact(x)) ? solid_.closest_point(exact(x)).distance : -1.0;
  }

 private:
  static Eigen::Vector3d exact(Float3 x) { return {x.x, x.y, x.z}; }
  Float3 vertex(std::uint32_t i) const {
    const float* v = view_.vertices + 3 * std::size_t{i};
    return {v[0], v[1], v[2]};
  }

  const MeshSolid& solid_;
  const MeshView& view_;
};

}  // namespace ist::packing
