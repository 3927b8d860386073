#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include <ist/cover_spheres.h>

#include "mesh/geometry/mesh_view.h"

namespace ist {

/// A place of the surface outside all balls.
struct OpenCorner {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< unit frame
  double gap = 0;                                   ///< unit frame, > 0: to the nearest ball
};

/// Places of the surface outside the balls, unit frame; none where it is contained, but for
/// rounding: this is for a search, open_surface() proves. Others may be further outside, between
/// balls of unlike radii by a few times as far.
///
/// The balls' power diagram cuts each triangle into convex pieces, and of a piece the ball of its
/// cell is that to which its points are nearest, by power. So the ball contains the piece if it
/// contains its corners, and if it does not, no ball contains that corner.
///
/// `holders`: of each triangle a ball that may contain it whole, from an earlier call with balls
/// that have moved little, or nothing; it takes those of this one.
std::vector<OpenCorner> open_corners(const MeshView& mesh, std::span<const CoverSphere> balls,
                                     std::vector<std::uint32_t>& holders);

}  // namespace ist
