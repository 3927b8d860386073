#include "query/impact/moving_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ist/asset_layout.h>
#include "query/impact/impact_side.h"

namespace ist {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Rounding of a straight motion: a product, a sum and the rounded time.
constexpr double kPathRounding = 6 * 0x1p-53;
// Rounding of a rotation: a polynomial's sine and its angle, three-term products and sums.
constexpr double kTurnRounding = 32 * 0x1p-53;

/// [u] from the solid's origin to the point that moves straight, world.
Vector3d lever(const Pose& pose, double scale, const Vector3d& about) noexcept {
  return unit_rotation(pose) * (scale * about);
}

MovingBody body(const Pose& pose, double scale, const Motion& motion, const AssetHeader* asset,
                double unit) noexcept {
  MovingBody body;
  body.turning = Turning(unit_rotation(pose), motion.angular_velocity);
  body.spin = motion.angular_velocity;
  body.spin_speed = body.spin.stableNorm();
  body.centre = motion.about;
  body.unit = scale / unit;
  if (asset == nullptr) {
    body.reach =
        body.unit * body.centre.norm();  // of its origin; place() adds the other's distance
    return body;
  }
  body.unit = std::ldexp(scale, asset->exponent) / unit;
  for (int k = 0; k < 3; ++k)
    body.centre[k] = std::ldexp(motion.about[k] - asset->centre[k], -asset->exponent);
  const RootBall root = root_ball(*asset);
  double error = 0;
  if (asset->mesh != 0) {
    const MeshHeader& mesh = *at<MeshHeader>(*asset, asset->mesh);
    error = mesh.error + mesh.rounding;
  }
  body.reach = body.unit * ((Vector3d(root.centre) - body.centre).norm() + root.reach() + error);
  return body;
}

bool usable(const Motion& motion) noexcept {
  return motion.velocity.allFinite() && motion.angular_velocity.allFinite() &&
         motion.about.allFinite();
}

/// `asset_a`: null for a shape.
std::optional<MovingFrame> frame_of(const Pose& pose_a, double scale_a, const AssetHeader* asset_a,
                                    const PlacedAsset& b, const std::optional<RelativePose>& start,
                                    const Motions& motions, double duration) noexcept {
  if (!start || !usable(motions.a) || !usable(motions.b) || !(duration > 0)) return std::nullopt;
  MovingFrame frame;
  frame.start = *start;
  frame.unit = start->unit_a;
  frame.a = body(pose_a, scale_a, motions.a, asset_a, frame.unit);
  frame.b = body(b.pose, b.scale, motions.b, &b.asset.header(), frame.unit);
  const Vector3d lever_a = lever(pose_a, scale_a, motions.a.about);
  frame.between = ((vector(b.pose.t) - vector(pose_a.t)) +
                   (lever(b.pose, b.scale, motions.b.about) - lever_a)) /
                  frame.unit;
  frame.velocity = (motions.b.velocity - motions.a.velocity) / frame.unit;
  frame.speed = frame.velocity.stableNorm();
  frame.world = vector(pose_a.t) + lever_a;
  frame.drift = motions.a.velocity;
  const double farthest =
      frame.between.norm() + frame.speed * duration + frame.a.reach + frame.b.reach;
  const double angles = (frame.a.spin_speed + frame.b.spin_speed) * duration;
  if (!in_pose_range({farthest, angles, 0})) return std::nullopt;
  return frame;
}

}  // namespace

SineCosine sine_cosine(double h) noexcept {
  const double x = h * h;
  double sine = 0, cosine = 0;
  for (int n = 22; n >= 2; n -= 2) {
    sine = (1 + sine) * -x / (n * (n + 1));
    cosine = (1 + cosine) * -x / (n * (n - 1));
  }
  return {h + h * sine, 1 + cosine};
}

Turning::Turning(const Quaterniond& start, const Vector3d& angular_velocity) noexcept
    : start_(start) {
  const double speed = angular_velocity.stableNorm();
  if (!(speed > 0)) return;
  axis_ = angular_velocity / speed;
  turns_ = speed / (2 * std::numbers::pi);
}

Quaterniond Turning::at(double time) const noexcept {
  if (turns_ == 0) return start_;
  const double turns = turns_ * time;
  const SineCosine half = sine_cosine(std::numbers::pi * (turns - std::floor(turns + 0.5)));
  const Vector3d v = half.sine * axis_;
  return Quaterniond(half.cosine, v.x(), v.y(), v.z()) * start_;
}

Placement place(const MovingFrame& frame, double time) noexcept {
  Placement at;
  at.time = time;
  at.a = frame.a.unit * frame.a.turning.at(time).toRotationMatrix();
  at.b = frame.b.unit * frame.b.turning.at(time).toRotationMatrix();
  at.between = frame.between + frame.velocity * time;
  const double path = frame.between.norm() + frame.speed * time;
  // B's coordinates may be rotated into A's frame.
  const double around_a = frame.a.reach + at.between.norm() + frame.b.reach;
  at.error = kPathRounding * path + kTurnRounding * (around_a * (1 + frame.a.spin_speed * time) +
                                                     frame.b.reach * frame.b.spin_speed * time);
  return at;
}

std::optional<MovingFrame> moving_frame(const PlacedAsset& a, const PlacedAsset& b,
                                        const Motions& motions, double duration) noexcept {
  return frame_of(a.pose, a.scale, &a.asset.header(), b, relative_pose(a, b), motions, duration);
}

std::optional<MovingFrame> moving_frame(const PlacedShape& a, const PlacedAsset& b,
                                        const Motions& motions, double duration) noexcept {
  return frame_of(a.pose, a.scale, nullptr, b, relative_pose(a.pose, a.scale, b), motions,
                  duration);
}

double safe_step(double gap, double rate, double bend) noexcept {
  constexpr double kLess = 1 - 1e-12;
  if (!(gap > 0)) return 0;
  if (!(bend > 0)) return rate > 0 ? kLess * gap / rate : std::numeric_limits<double>::infinity();
  const double root = std::sqrt(rate * rate + 2 * bend * gap);
  return kLess * (rate >= 0 ? 2 * gap / (rate + root) : (root - rate) / bend);
}

Motion motion_between(const Pose& from, const Pose& to, double duration, const Vector3d& about,
                      double scale) noexcept {
  Motion motion;
  motion.about = about;
  if (!(duration > 0) || !usable_rotation(from, scale) || !usable_rotation(to, scale)) {
    motion.velocity.setConstant(std::numeric_limits<double>::quiet_NaN());
    return motion;
  }
  const Vector3d straight =
      (vector(to.t) - vector(from.t)) + (lever(to, scale, about) - lever(from, scale, about));
  motion.velocity = straight / duration;
  Quaterniond turn = unit_rotation(to) * unit_rotation(from).conjugate();
  if (turn.w() < 0) turn.coeffs() *= -1;
  const double sine = turn.vec().norm();
  if (!(sine > 0)) return motion;
  // Half the angle, in [0, π/2], by an iteration that triples the correct digits.
  double half = sine * (std::numbers::pi / 2 - turn.w() * (std::numbers::pi / 2 - 1));
  for (int i = 0; i < 4; ++i) {
    const SineCosine at = sine_cosine(half);
    half += sine * at.cosine - turn.w() * at.sine;
  }
  motion.angular_velocity = turn.vec() / sine * (2 * half / duration);
  return motion;
}

Pose moved(const Pose& start, const Motion& motion, double time, double scale) noexcept {
  const Quaterniond rotation = Turning(unit_rotation(start), motion.angular_velocity).at(time);
  const Vector3d place = vector(start.t) + lever(start, scale, motion.about) +
                         motion.velocity * time - rotation * (scale * motion.about);
  return {{rotation.w(), rotation.x(), rotation.y(), rotation.z()},
          {place.x(), place.y(), place.z()}};
}

}  // namespace ist
