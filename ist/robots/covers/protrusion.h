#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include <ist/cover_spheres.h>

#include "mesh/mesh_solid.h"

namespace ist {

/// How far a ball reaches out of the solid: both ends of an interval that contains it, unit frame.
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

}  // namespace ist
