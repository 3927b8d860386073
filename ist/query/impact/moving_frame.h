#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <optional>

#include <ist/time_of_impact.h>

#include "query/base/relative_pose.h"

namespace ist {

/// Sine and cosine of h in [−π/2, π/2]. Same bits on every processor, unlike the C library's.
struct SineCosine {
  double sine, cosine;
};
SineCosine sine_cosine(double h) noexcept;

/// A rotation at constant speed about a fixed axis, after one at time 0.
class Turning {
 public:
  Turning() = default;
  Turning(const Eigen::Quaterniond& start, const Eigen::Vector3d& angular_velocity) noexcept;
  Eigen::Quaterniond at(double time) const noexcept;

 private:
  Eigen::Quaterniond start_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero();
  double turns_ = 0;  ///< a unit of time
};

/// One body of a pair. x, of its unit frame, is at R(t) · unit · (x − centre) from the point of the
/// body that moves straight.
struct MovingBody {
  Turning turning;
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();  ///< angular velocity, world
  double spin_speed = 0;                           ///< its length
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double unit = 1;
  double reach = 0;  ///< no point of the body is further from its centre
};

/// Two moving bodies in a frame that moves with A's straight point without rotation, so that their
/// common motion cancels first. The unit of length is that of A's unit frame.
struct MovingFrame {
  MovingBody a, b;
  Eigen::Vector3d between = Eigen::Vector3d::Zero();   ///< from A's straight point to B's at 0
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of B's straight point
  double speed = 0;                                    ///< its length
  double unit = 1;                                     ///< [u]
  Eigen::Vector3d world = Eigen::Vector3d::Zero();     ///< [u] A's straight point at time 0
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();     ///< [u/T] its velocity
  RelativePose start;                                  ///< at time 0

  Eigen::Vector3d to_world(const Eigen::Vector3d& x, double time) const {
    return world + drift * time + unit * x;
  }
};

/// Both bodies at a time.
struct Placement {
  double time = -1;
  Eigen::Matrix3d a, b;     ///< unit · R
  Eigen::Vector3d between;  ///< from A's straight point to B's
  /// Bound on the error of distances computed from these, and on the motion within the rounding of
  /// `time`.
  double error = std::numeric_limits<double>::infinity();
};

Placement place(const MovingFrame& frame, double time) noexcept;

/// Empty if a pose or motion is not usable.
std::optional<MovingFrame> moving_frame(const PlacedAsset& a, const PlacedAsset& b,
                                        const Motions& motions, double duration) noexcept;
/// A shape's unit frame is its own frame.
std::optional<MovingFrame> moving_frame(const PlacedShape& a, const PlacedAsset& b,
                                        const Motions& motions, double duration) noexcept;

/// The time for which a gap lasts that shrinks at `rate`, a speed that grows by at most `bend`.
double safe_step(double gap, double rate, double bend) noexcept;

}  // namespace ist
