#pragma once

#include <Eigen/Core>
#include <functional>

#include <ist/pose.h>

#include "bake/predict/convex_body.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// Volume that two solids share.
struct SharedVolume {
  double volume = 0;  ///< [u³]
  double error = 0;   ///< [u³] estimate, from the spread of four parts of the lattice
};

/// Integrates the overlap of A and of B placed in A's frame, x_A = R (scale_b · x_B) + t, along
/// lines parallel to `along` (A's frame, any length > 0; a contact is measured best along its
/// normal): each is cut exactly where it meets the surfaces, and the lattice closes in on the
/// overlap and is refined until the error is no more than `relative_error` of the volume. Very
/// small overlaps between the first lines, a few thousandths of the solids' common extent apart,
/// are not seen. Same bits for any number of threads; runs on the caller's TBB threads.
/// `go_on`, if any, is asked every few milliseconds of work; once it says no, the result is empty.
SharedVolume shared_volume(const MeshSolid& a, const MeshSolid& b, const Pose& b_in_a,
                           double scale_b, const Eigen::Vector3d& along, double relative_error,
                           const std::function<bool()>& go_on = {});

/// Likewise of A and of a body in A's frame.
SharedVolume shared_volume(const MeshSolid& a, const ConvexBody& b, const Eigen::Vector3d& along,
                           double relative_error, const std::function<bool()>& go_on = {});

}  // namespace ist
