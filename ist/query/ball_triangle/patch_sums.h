#pragma once

#include <ist/asset_layout.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"

namespace ist {

/// Up to sixteen triangles, prepared for balls. Positions are in the surface's frame; (x, y) are
/// coordinates in a triangle's plane from its first corner, with its first edge along x.
struct alignas(64) SurfacePatch {
  double corner[3][3][kWidth];                  ///< [corner][axis]
  double u[3][kWidth], v[3][kWidth];            ///< unit axes of x and y
  double n[3][kWidth];                          ///< unit normal, outward
  double edge_x[3][kWidth], edge_y[3][kWidth];  ///< unit directions of the edges
  double length[3][kWidth];                     ///< of the edges
  /// Extent: x from left to right, y from 0 to top. Negative for degenerate triangles.
  double left[kWidth], right[kWidth], top[kWidth];
};

/// Corners of sixteen triangles, counter-clockwise from outside; three equal ones for no triangle.
struct alignas(64) TriangleCorners {
  double x[3][kWidth], y[3][kWidth], z[3][kWidth];
};

void make_patch(const TriangleCorners& corners, SurfacePatch& patch) noexcept;

/// A bit for each triangle that comes near a ball: all that reach it, and perhaps others.
std::uint32_t triangles_near(const SurfacePatch& patch, const double (&centre)[3],
                             double radius) noexcept;

/// Sixteen balls relative to an origin near them all. A radius of 0 stands for no ball.
struct alignas(64) ProbeBalls {
  double x[kWidth], y[kWidth], z[kWidth], r[kWidth];
  double origin[3];  ///< in the surface's frame
  double reach = 0;  ///< all of them lie within this of the origin

  Eigen::Vector3d centre(std::size_t i) const noexcept {
    return {origin[0] + x[i], origin[1] + y[i], origin[2] + z[i]};
  }
};

/// The mapped balls of a block, relative to its node's centre. Unused lanes get a radius of 0.
void place_probes(const SphereTree& probes, int level, std::uint32_t block, const Similarity& map,
                  ProbeBalls& balls) noexcept;

/// Integrals over the surface inside each of sixteen balls. Valid for balls in `met`.
struct ProbeSums {
  double cones[kWidth];     ///< volume between the surface and the ball's own
  double angle[kWidth];     ///< solid angle from the centre, > 0 if that sees the outer side
  double area[kWidth];      ///< of the surface
  double pull[3][kWidth];   ///< ∫ n dA over it
  double shift[3][kWidth];  ///< ½ ∫ (r² − |y − centre|²) n dA over it
  std::uint32_t met = 0;    ///< a bit for each ball that a triangle may intersect
  /// A bit for each ball whose centre is so close to an edge that rounding decides its side of the
  /// triangles: `cones` and `angle` are meaningless (off_edges).
  std::uint32_t on_edge = 0;
  std::uint32_t pairs = 0;  ///< of balls and triangles that were computed

  void meet(std::size_t ball) noexcept {
    if ((met >> ball & 1) != 0) return;
    met |= 1u << ball;
    cones[ball] = angle[ball] = area[ball] = 0;
    for (int k = 0; k < 3; ++k) pull[k][ball] = shift[k][ball] = 0;
  }
};

/// Adds the patch's integrals. Once all triangles that reach a ball are added, its part inside the
/// closed surface has the volume [centre inside] · v + cones, the gradient −pull by the centre, and
/// the first moment −shift about the centre. Exact except for rounding, some 1e-15 of r³. Same bits
/// on every instruction set.
///
/// Each triangle subtracts (or adds, if its outer side faces the centre) the part of its cone
/// between itself and the sphere: (r³ Ω − h A) / 3 over its part within the ball.
///
/// `triangles`, `chosen`: masks of the triangles and balls to use. `triangles` must contain all
/// that come near one of these balls. Vectorised over balls or triangles, whichever are more.
void add_patch(const SurfacePatch& patch, std::uint32_t triangles, const ProbeBalls& balls,
               std::uint32_t chosen, ProbeSums& sums) noexcept;

/// The chosen balls, moved off edges by some 2e-4 of their radii; the others get a radius of 0.
ProbeBalls away_from_edges(const ProbeBalls& balls, std::uint32_t chosen) noexcept;

/// Corrects `cones` and `angle` of the balls on edges by the sums of the moved balls. The angle is
/// the moved ball's. The volume is smooth in the centre, so the mean of both gradients takes it
/// back to some 1e-11 of r³: the error is of the third derivative.
void put_right(const ProbeSums& moved, const ProbeBalls& balls, ProbeSums& sums) noexcept;

/// Corrects the balls on edges once all triangles are added. `add(moved, there)` adds to `there`
/// all triangles near the moved balls. Returns the balls with the centres that decide their sides.
template <class Add>
ProbeBalls off_edges(const ProbeBalls& balls, ProbeSums& sums, const Add& add) noexcept {
  if (sums.on_edge == 0) return balls;
  const ProbeBalls moved = away_from_edges(balls, sums.on_edge);
  ProbeSums there;
  add(moved, there);
  put_right(there, balls, sums);
  ProbeBalls seen = moved;
  std::copy(balls.r, balls.r + kWidth, seen.r);
  seen.reach = balls.reach;
  return seen;
}

}  // namespace ist
