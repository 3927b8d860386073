#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>

namespace ist {

/// Triangles near a block of balls, as the balls meet them. Positions are relative to an origin
/// near them all, in the surface's frame; (x, y) are coordinates in a triangle's plane from its
/// first corner, the first edge lying along x.
struct alignas(64) SurfacePatch {
  static constexpr std::size_t kMost = 64;

  double corner[3][kMost];                 ///< the first one
  double u[3][kMost], v[3][kMost];         ///< unit axes of x and y
  double n[3][kMost];                      ///< unit normal, outward
  double edge_x[3][kMost], edge_y[3][kMost];  ///< unit directions of the edges
  double length[3][kMost];                    ///< of the edges
  double left[kMost], right[kMost], top[kMost];  ///< extent: x from left to right, y from 0 to top
  std::size_t size = 0;

  bool full() const noexcept { return size == kMost; }

  /// Adds a triangle; one without an area adds nothing.
  void add(const double (&a)[3], const double (&b)[3], const double (&c)[3]) noexcept;
};

/// Sixteen balls around the same origin. A radius of 0 meets nothing.
struct alignas(64) ProbeBalls {
  double x[kWidth], y[kWidth], z[kWidth], r[kWidth];
};

/// What the surface does to each of sixteen balls; all factors included.
struct ProbeSums {
  double cones[kWidth] = {};     ///< volume between the surface inside the ball and the ball's own
  double angle[kWidth] = {};     ///< solid angle of that surface, seen from the centre: > 0 if it
                                 ///< is seen from outside
  double area[kWidth] = {};      ///< of that surface
  double pull[3][kWidth] = {};   ///< ∫ n dA over it
  double shift[3][kWidth] = {};  ///< ½ ∫ (r² − |y − centre|²) n dA over it
  std::uint32_t met = 0;         ///< a bit a ball that a triangle may meet
  std::uint32_t pairs = 0;       ///< balls and triangles that were put together
};

/// Adds the patch's share to the sums. The part of a ball of volume v inside a closed surface has
/// the volume [centre inside] · v + cones, the gradient −pull by the centre, and the first moment
/// −shift about the centre, once all triangles that reach the ball are added. Exact but for
/// rounding, some 1e-15 of r³. Same bits on every instruction set.
///
/// By rays from the centre: each triangle takes away, or adds where it is seen from outside, the
/// part of its cone between itself and the sphere, (r³ Ω − h A) / 3 over the part within the ball.
void add_patch(const SurfacePatch& patch, const ProbeBalls& balls, ProbeSums& sums) noexcept;

}  // namespace ist
