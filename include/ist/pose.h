#pragma once

#include <ist/api.h>

namespace IST_API ist {

/// Rigid motion from an object's own frame to the world: x_world = R(q) x + t.
///
/// Lengths from 1e-150 to 1e150 are normalised: q means q/|q|. Others are invalid.
///
/// One range holds for every query, on the CPU and on GPUs. In the unit frame of a solid, the
/// coordinates of another solid's frame or of a point are at most 1e60. Sizes differ by at most
/// 1e60 : 1. A motion stays within this range. Beyond it queries return invalid_input.
///
/// Plain data of 56 bytes under every compiler flag. `pose_eigen.h` converts from and to Eigen.
struct Pose {
  double q[4] = {1, 0, 0, 0};  ///< quaternion w, x, y, z; of any length but 0: it is normalised
  double t[3] = {0, 0, 0};     ///< [u] translation
};

}  // namespace ist
