#pragma once

#include <ist/cover_spheres.h>
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

/// The distance by which a ball protrudes: both ends of an interval that contains it, unit frame.
struct BallProtrusion {
  double least = 0, most = 0;
};

/// `tolerance`: the interval's width over its upper end is at most about this, or the upper end is
/// at most `enough`.
BallProtrusion ball_protrusion(const MeshSolid& solid, const CoverSphere& ball, double tolerance,
                               double enough);

/// The same to float rounding, proven of nothing. `beyond` takes points of the ball further out
/// than `enough`.
BallProtrusion guessed_protrusion(const MeshSolid& solid, const CoverSphere& ball, double tolerance,
                                  double enough, std::vector<Eigen::Vector3d>& beyond);

/// The same of all, by their largest, and what sampling says of the union; unit frame.
SphereProtrusion protrusion_of(const MeshSolid& solid, std::span<const CoverSphere> balls);

/// A part of the surface that no ball is shown to contain whole.
struct OpenPart {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< unit frame
  std::uint32_t ball = 0;                            ///< that has to grow least to contain the part
  double radius = 0;                                 ///< unit frame: and then would
  double gap = 0;  ///< unit frame, from the middle to the nearest ball; 0: the middle is contained
};

/// Parts of the mesh's triangles that may stick out of the union of the balls, unit frame. Each is
/// small: for its own parts a ball would have to grow almost as much, by `finest` less at most, or
/// it is small beside its gap. What is not in the list is proven: a part all of whose corners one
/// ball contains is contained, for balls are convex; other parts are divided. `most`: of a
/// triangle, then the rest of it is left unproven.
std::vector<OpenPart> open_surface(const MeshView& mesh, std::span<const CoverSphere> balls,
                                   double finest, std::size_t most = SIZE_MAX);

/// A place inside the solid that the balls do not contain, or that could not be proven, if there is
/// one.
struct OpenPlace {
  bool found = false;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< unit frame
  double gap = 0;                                   ///< unit frame; 0: merely not proven
};

/// Proves that balls which contain the surface leave no void inside (docs/design.md 13): of a void
/// that touches no surface the hull's corners are points where three balls' surfaces meet, so it is
/// enough to look where three do: at cubes, divided until a ball contains them whole, fewer than
/// three surfaces cross them, or they lie outside the solid.
OpenPlace open_void(const MeshSolid& solid, std::span<const CoverSphere> balls);

/// Makes balls just so much larger that both proofs succeed: what sticks out goes to the ball that
/// grows least. `finest`: unit frame, how close to just enough.
void grow_to_cover(const MeshSolid& solid, std::vector<CoverSphere>& balls, double finest);

}  // namespace ist
