#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "query/ball_triangle/surface_patch.h"

namespace ist {

/// The effect of the surface on each of sixteen balls, all factors included. Valid for balls that
/// touch it.
struct ProbeSums {
  double cones[kWidth];    ///< volume between the surface inside the ball and the ball's own
  double angle[kWidth];    ///< solid angle of that surface, seen from the centre: > 0 if it is seen
                           ///< from outside
  double area[kWidth];     ///< of that surface
  double pull[3][kWidth];  ///< ∫ n dA over it
  double shift[3][kWidth];  ///< ½ ∫ (r² − |y − centre|²) n dA over it
  std::uint32_t met = 0;    ///< a bit a ball that a triangle may meet
  /// A bit a ball whose centre all but lies on an edge: rounding decides from where it sees the
  /// triangles there, and `cones` and `angle` are worth nothing (away_from_edges).
  std::uint32_t on_edge = 0;
  std::uint32_t pairs = 0;  ///< balls and triangles that were put together

  void meet(std::size_t ball) noexcept {
    if ((met >> ball & 1) != 0) return;
    met |= 1u << ball;
    cones[ball] = angle[ball] = area[ball] = 0;
    for (int k = 0; k < 3; ++k) pull[k][ball] = shift[k][ball] = 0;
  }
};

/// Adds the patch's share to the sums. Once all triangles that reach a ball are added, the part of
/// it inside the closed surface has the volume [centre inside] · v + cones, the gradient −pull by
/// the centre, and the first moment −shift about the centre. Exact but for rounding, some 1e-15 of
/// r³. Same bits on every instruction set.
///
/// By rays from the centre: each triangle takes away, or adds where it is seen from outside, the
/// part of its cone between itself and the sphere, (r³ Ω − h A) / 3 over the part within the ball.
///
/// `triangles`: those to look at, a bit each; all that come near one of the balls. `chosen`: the
/// balls to look at. A vector goes over the balls or over the triangles, whichever are more.
void add_patch(const SurfacePatch& patch, std::uint32_t triangles, const ProbeBalls& balls,
               std::uint32_t chosen, ProbeSums& sums) noexcept;

/// The chosen balls moved by some 2e-4 of their radii, where their centres see each edge from one
/// side; the others get a radius of 0.
ProbeBalls away_from_edges(const ProbeBalls& balls, std::uint32_t chosen) noexcept;

/// Puts right `cones` and `angle` of the balls on edges by their sums where they were moved to. The
/// angle is that of the moved ball; the volume is good to some 1e-11 of r³, being smooth in the
/// centre: by the mean of both gradients it misses no more than the third derivative.
void put_right(const ProbeSums& moved, const ProbeBalls& balls, ProbeSums& sums) noexcept;

/// Puts the balls on edges right, once all triangles are added. `add(moved, there)` adds to `there`
/// all that comes near them where they were moved to. Returns the balls with the centres by which
/// their sides are to be told.
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
