#pragma once

#include <ist/cover_spheres.h>
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

/// Bounds of the distance by which a ball protrudes, unit frame.
struct BallProtrusion {
  double least = 0, most = 0;
};

/// `tolerance`: the interval's relative width is at most about this, or its upper end is at most
/// `enough`.
BallProtrusion ball_protrusion(const MeshSolid& solid, const CoverSphere& ball, double tolerance,
                               double enough);

/// The same to float rounding, without proof. `beyond` receives points of the ball further out than
/// `enough`.
BallProtrusion guessed_protrusion(const MeshSolid& solid, const CoverSphere& ball, double tolerance,
                                  double enough, std::vector<Eigen::Vector3d>& beyond);

/// The same for all balls, by their maximum, and sampled properties of the union; unit frame.
SphereProtrusion protrusion_of(const MeshSolid& solid, std::span<const CoverSphere> balls);

/// A part of the surface that is not proven to be in a single ball.
struct OpenPart {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< unit frame
  std::uint32_t ball = 0;  ///< that needs the least growth to contain the part
  double radius = 0;       ///< unit frame: the radius then
  double gap = 0;  ///< unit frame, from the middle to the nearest ball; 0: the middle is contained
};

/// Parts of the mesh's triangles that may protrude from the union of the balls, unit frame. Each is
/// small: for its own parts a ball would have to grow almost as much, by at most `finest` less, or
/// it is small compared with its gap. Everything else is proven: a part whose corners are all in
/// one ball is contained, since balls are convex; other parts are divided. `most`: parts of a
/// triangle, after which the rest of it is left unproven.
std::vector<OpenPart> open_surface(const MeshView& mesh, std::span<const CoverSphere> balls,
                                   double finest, std::size_t most = SIZE_MAX);

/// A place inside the solid that the balls do not contain, or for which this could not be proven,
/// if there is one.
struct OpenPlace {
  bool found = false;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< unit frame
  double gap = 0;                                   ///< unit frame; 0: only unproven
};

/// Proves that balls which contain the surface leave no void inside (docs/design.md 13). The hull's
/// corners of a void that touches no surface are points where three balls' surfaces meet. So it
/// suffices to examine such points: in cubes, divided until a ball contains them, fewer than three
/// surfaces cross them, or they lie outside the solid.
OpenPlace open_void(const MeshSolid& solid, std::span<const CoverSphere> balls);

/// Enlarges balls just enough for both proofs to succeed: a protruding part is assigned to the ball
/// that grows least. `finest`: unit frame, the precision of the radii.
void grow_to_cover(const MeshSolid& solid, std::vector<CoverSphere>& balls, double finest);

}  // namespace ist
