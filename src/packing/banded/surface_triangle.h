#pragma once

#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/triangle_frame.h"
#include "packing/banded/sample.h"

namespace ist::packing {

/// A triangle in its frame (TriangleFrame<float>), as the cell work reads it from any hierarchy.
struct SurfaceTriangle {
  Float3 origin, u, v, n;
  float length = 0, apex = 0, height = 0;
  std::uint32_t index = 0;  ///< in the mesh
};

/// The triangle in a lane of a hierarchy's block (TriangleBlock, WideBlock).
template <class Block>
IST_HD SurfaceTriangle triangle_of(const Block& b, std::uint32_t lane) {
  return {{b.origin[0][lane], b.origin[1][lane], b.origin[2][lane]},
          {b.u[0][lane], b.u[1][lane], b.u[2][lane]},
          {b.v[0][lane], b.v[1][lane], b.v[2][lane]},
          {b.n[0][lane], b.n[1][lane], b.n[2][lane]},
          b.length[lane],
          b.apex[lane],
          b.height[lane],
          b.triangle[lane]};
}

/// The offset of x from the triangle's closest point; searches compare range2.
IST_HD inline FeatureOffset triangle_offset(const SurfaceTriangle& t, Float3 x) {
  const Float3 d = x - t.origin;
  const float along_u = dot(d, t.u), along_v = dot(d, t.v), along_n = dot(d, t.n);
  const FramePoint<float> q =
      closest_in_frame(along_u, along_v, along_n, t.length, t.apex, t.height);
  return {(along_u - q.x) * t.u + (along_v - q.y) * t.v + along_n * t.n, q.distance2, 0,
          kSurfaceTag | t.index};
}

/// If the solid is locally an intersection of half-spaces, its faces' planes bound the clearance in
/// a whole cell, however large the cell is compared with its distance from them. Let S be all
/// triangles within 3h of x. If each lies on the inner side of every other one's plane, then, as
/// the surface is closed, the solid near x is the intersection P of the half-spaces of S: none of
/// it is beyond a half-space, and from a point of P within h of x the straight segment to a plane
/// no further than h from x meets the surface before that plane. Writes these planes as constraints
/// behind the first `from` of `out`; returns their number, 0 if S does not qualify, is too large,
/// or they do not fit.
///
/// `surface`: triangles_within(), triangle(), inside_once(). `triangles`: memory for `most` of
/// them.
template <class Team, class Surface>
IST_HD int convex_planes(const Team& team, const Surface& surface, Float3 x, float h, bool x_inside,
                         typename Surface::Feature* triangles, int most, SampleMemory* out,
                         int from) {
  constexpr float kTolerance = 4e-7f;  // rounding of the frames
  const int count = surface.triangles_within(team, x, 9 * h * h, triangles, most);
  if (count <= 0) return 0;
  bool convex = true;
  for (int i = team.lane(); i < count && convex; i += Team::kWidth) {
    const SurfaceTriangle mine = surface.triangle(triangles[i]);
    convex = mine.height > 1e-9f * mine.length;
    for (int j = 0; j < count && convex; ++j) {
      const SurfaceTriangle t = surface.triangle(triangles[j]);
      const Float3 corner[3] = {t.origin, t.origin + t.length * t.u,
                                t.origin + t.apex * t.u + t.height * t.v};
      for (int k = 0; k < 3; ++k)
        convex = convex && dot(-1.0f * mine.n, corner[k] - mine.origin) >= -kTolerance;
    }
  }
  if (!team.all(convex)) return 0;
  if (x_inside && !surface.inside_once(team, x)) return 0;
  int written = 0;
  for (int base = 0; base < count; base += Team::kWidth) {
    const int i = base + team.lane();
    Constraint c;
    bool near = i < count;
    if (near) {
      const SurfaceTriangle t = surface.triangle(triangles[i]);
      const float distance = dot(-1.0f * t.n, x - t.origin);
      near = distance < h;
      c = {-1.0f * t.n, distance + kTolerance, 0, kPlaneTag | t.index};
    }
    int total = 0;
    const int place = from + written + team.exclusive_count(near, total);
    if (from + written + total > kSampleCapacity) return 0;
    if (near) put(team, out, place, c);
    written += total;
  }
  team.sync();
  return written;
}

/// Base of MeshSurface and WideMeshSurface. Features are triangles, identified by their positions
/// in the hierarchy's blocks; no answer depends on the hierarchy. All lanes of a team call its
/// functions and get the same result.
template <class Surface>
class TriangleSurface {
 public:
  using Feature = std::uint32_t;
  static constexpr int kAscentSteps =
      5;  ///< more do not increase the coverage (docs/packing_notes.md)

  /// The offset of x from a remembered feature; per lane.
  IST_HD FeatureOffset offset(Feature feature, Float3 x) const {
    return triangle_offset(self().triangle(feature), x);
  }

  template <class Team>
  IST_HD bool inside(const Team& team, Float3 x) const {
    return self().winding_number(team, x) >= 1;
  }

  /// True if the winding number is 1: no other shell of the solid contains x.
  template <class Team>
  IST_HD bool inside_once(const Team& team, Float3 x) const {
    return self().winding_number(team, x) == 1;
  }

  /// Exact clearance for certification: distance to the surface, at most `limit`, negative outside.
  template <class Team>
  IST_HD double clearance(const Team& team, Float3 x, double limit) const {
    return inside(team, x) ? self().exact_distance(team, x, limit) : -1.0;
  }

 private:
  IST_HD const Surface& self() const { return static_cast<const Surface&>(*this); }
};

}  // namespace ist::packing
