#pragma once

#include "mesh/geometry/closest_point.h"
#include "mesh/mesh_solid.h"
#include "packing/banded/surface_triangle.h"

namespace ist::packing {

/// The surface of a mesh on the host, in the form that packing uses.
class MeshSurface : public TriangleSurface<MeshSurface> {
 public:
  explicit MeshSurface(const MeshSolid& solid) : solid_(solid), view_(solid.view()) {}

  /// Unsigned distance to the surface, and the feature there, if it is at most `limit`. Among
  /// equals the triangle with the smallest index.
  template <class Team>
  NearestFeature<Feature> nearest(const Team&, Float3 x, float limit) const {
    const float p[3] = {x.x, x.y, x.z};
    float best2 = limit * limit;
    std::uint32_t best = kNoTriangle;
    Feature feature = 0;
    for_triangles_near(view_, p, best2, [&](const NearTriangle& near) {
      if (near.closest.distance2 < best2 ||
          (near.closest.distance2 == best2 && near.triangle < best)) {
        best2 = near.closest.distance2;
        best = near.triangle;
        feature = slot(near);
      }
      return best2;
    });
    return {feature, std::sqrt(best2), best != kNoTriangle};
  }

  SurfaceTriangle triangle(Feature feature) const {
    return triangle_of(view_.blocks[feature / kBvhWidth], feature % kBvhWidth);
  }

  /// Finds all triangles whose distance² is at most radius2; returns their number, −1 if more than
  /// `most`.
  template <class Team>
  int triangles_within(const Team& team, Float3 x, float radius2, Feature* out, int most) const {
    const float p[3] = {x.x, x.y, x.z};
    int count = 0;
    for_triangles_near(view_, p, radius2, [&](const NearTriangle& near) {
      if (count == most) count = -1;
      if (count < 0) return 0.0f;
      if (count % Team::kWidth == team.lane()) out[count] = slot(near);
      ++count;
      return radius2;
    });
    team.sync();
    return count;
  }

  template <class Team>
  int convex_planes(const Team& team, Float3 x, float h, bool x_inside, Feature* triangles,
                    int most, SampleMemory* out, int from) const {
    return packing::convex_planes(team, *this, x, h, x_inside, triangles, most, out, from);
  }

  template <class Team>
  int winding_number(const Team&, Float3 x) const {
    return solid_.winding_number(exact(x));
  }

  /// Exact unsigned distance, `limit` if it is not less.
  template <class Team>
  double exact_distance(const Team&, Float3 x, double limit) const {
    return solid_.closest_point(exact(x), limit).distance;
  }

 private:
  static Eigen::Vector3d exact(Float3 x) { return {x.x, x.y, x.z}; }
  Feature slot(const NearTriangle& near) const {
    return static_cast<std::uint32_t>(near.block - view_.blocks) * kBvhWidth +
           static_cast<std::uint32_t>(near.lane);
  }

  const MeshSolid& solid_;
  const MeshView& view_;
};

}  // namespace ist::packing
