#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "query/ball_triangle/surface_patch.h"

namespace ist {

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
/// the first moment −shift about the centre. Exact but for rounding, some 1e-15 of r³. Same bits on
/// every instruction set.
///
/// By rays from the centre: each triangle subtracts, or adds where its outer side is seen, the part
/// of its cone between itself and the sphere, (r³ Ω − h A) / 3 over its part within the ball.
///
/// `triangles`, `chosen`: a bit for each triangle and ball to use; all triangles that come near one
/// of these balls. A vector goes over the balls or the triangles, whichever are more.
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
