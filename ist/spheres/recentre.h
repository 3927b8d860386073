#pragma once

#include <Eigen/Core>
#include <span>

namespace ist {

/// A ball's centre, and by how much its farthest point is further than its nearest wall.
struct Recentred {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double excess = 0;
};

/// Moves a centre, by at most `trust`, so that the farthest of `points` is as little beyond the
/// nearest of `walls` as can be: steepest descent of max |p − c| − min |w − c|, along the shortest
/// vector of the hull of all slopes that nearly count. `points` must not be empty; walls missing
/// from the list must be no nearer than any of it, wherever the centre may go.
Recentred recentre(const Eigen::Vector3d& start, std::span<const Eigen::Vector3d> points,
                   std::span<const Eigen::Vector3d> walls, double trust);

}  // namespace ist
