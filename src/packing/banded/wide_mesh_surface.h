#pragma once

#include "mesh/hierarchy/wide_searches.h"
#include "packing/banded/surface_triangle.h"

namespace ist::packing {

/// The surface of a mesh on the GPU: MeshSurface over a WideTree, with the same bits.
class WideMeshSurface : public TriangleSurface<WideMeshSurface> {
 public:
  IST_HD explicit WideMeshSurface(const WideTree& tree) : tree_(tree) {}

  template <class Team>
  IST_HD_ONCE NearestFeature<Feature> nearest(const Team& team, Float3 x, float limit) const {
    const WideTree tree = tree_;  // a copy that stores cannot alias stays in registers
    const float p[3] = {x.x, x.y, x.z};
    const WideNearest found = ist::nearest(team, tree, p, limit * limit);
    return {found.slot, sqrtf(found.distance2), found.triangle != kNoTriangle};
  }

  IST_HD SurfaceTriangle triangle(Feature feature) const {
    return triangle_of(tree_.block(feature / kWideWidth), feature % kWideWidth);
  }

  template <class Team>
  IST_HD int triangles_within(const Team& team, Float3 x, float radius2, Feature* out,
                              int most) const {
    const WideTree tree = tree_;
    const float p[3] = {x.x, x.y, x.z};
    const int count = ist::triangles_within(team, tree, p, radius2, out, most);
    return count > most ? -1 : count;
  }

  template <class Team>
  IST_HD_ONCE int convex_planes(const Team& team, Float3 x, float h, bool x_inside,
                                Feature* triangles, int most, SampleMemory* out, int from) const {
    return packing::convex_planes(team, *this, x, h, x_inside, triangles, most, out, from);
  }

  template <class Team>
  IST_HD_ONCE int winding_number(const Team& team, Float3 x) const {
    const WideTree tree = tree_;
    const double p[3] = {x.x, x.y, x.z};
    return ist::winding_number(team, tree, p);
  }

  /// Exact unsigned distance, `limit` if it is not less.
  template <class Team>
  IST_HD_ONCE double exact_distance(const Team& team, Float3 x, double limit) const {
    const WideTree tree = tree_;
    const double p[3] = {x.x, x.y, x.z};
    return exact_nearest(team, tree, p, limit).distance;
  }

 private:
  WideTree tree_;
};

}  // namespace ist::packing
