#pragma once

#include <ist/api.h>

namespace IST_API ist {

/// Rigid motion from an object's own frame to the world: x_world = R(q) x + t.
///
/// Plain data of 56 bytes under every compiler flag. `pose_eigen.h` converts from and to Eigen.
struct Pose {
  double q[4] = {1, 0, 0, 0};  ///< quaternion w, x, y, z; within 1e-3 of unit length
  double t[3] = {0, 0, 0};     ///< [u] translation
};

}  // namespace ist
