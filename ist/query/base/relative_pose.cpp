#include "query/base/relative_pose.h"

#include <cmath>

#include <ist/asset_layout.h>

#include "query/asset/shared_constants.h"

namespace ist {
namespace {

struct Frame {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;  ///< [u] of the object's origin
  Eigen::Vector3d offset;       ///< [u] from the object's origin to its unit frame's, own axes
  double unit;                  ///< [u]
};

std::optional<Frame> frame_of(const Pose& pose, double scale) {
  const std::optional<Eigen::Quaterniond> rotation = usable_rotation(pose, scale);
  if (!rotation) return std::nullopt;
  Frame frame;
  frame.rotation = *rotation;
  frame.translation = Eigen::Vector3d(pose.t[0], pose.t[1], pose.t[2]);
  frame.offset = Eigen::Vector3d::Zero();
  frame.unit = scale;
  return frame;
}

std::optional<Frame> frame_of(const PlacedTree& placed) {
  if (placed.tree.empty()) return std::nullopt;
  std::optional<Frame> frame = frame_of(placed.pose, placed.scale);
  if (!frame) return std::nullopt;
  const AssetHeader& header = placed.tree.header();
  frame->offset =
      placed.scale * Eigen::Vector3d(header.centre[0], header.centre[1], header.centre[2]);
  frame->unit = std::ldexp(placed.scale, header.exponent);
  return frame;
}

Similarity similarity(double scale, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& t) {
  Similarity s;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) s.m[3 * i + j] = scale * rotation(i, j);
    s.t[i] = t[i];
  }
  s.scale = scale;
  return s;
}

std::optional<RelativePose> relative(const std::optional<Frame>& fa,
                                     const std::optional<Frame>& fb) {
  if (!fa || !fb) return std::nullopt;

  const Eigen::Matrix3d rotation = (fa->rotation.conjugate() * fb->rotation).toRotationMatrix();
  const Eigen::Vector3d between = fa->rotation.conjugate() * (fb->translation - fa->translation);
  const Eigen::Vector3d t = (between + (rotation * fb->offset - fa->offset)) / fa->unit;
  const double scale = fb->unit / fa->unit;
  if (!(t.norm() <= kFarthestPose) || !(scale <= kFarthestPose) || !(scale >= 1 / kFarthestPose))
    return std::nullopt;

  RelativePose pose;
  pose.a_from_b = similarity(scale, rotation, t);
  pose.b_from_a = similarity(1 / scale, rotation.transpose(), -(rotation.transpose() * t) / scale);
  pose.rotation_a = fa->rotation.toRotationMatrix();
  pose.unit_origin_a = fa->translation + fa->rotation * fa->offset;
  pose.unit_offset_b = fb->rotation * fb->offset;
  pose.unit_a = fa->unit;
  return pose;
}

}  // namespace

std::optional<Eigen::Quaterniond> usable_rotation(const Pose& pose, double scale) noexcept {
  const double* q = pose.q;
  const double* t = pose.t;
  const double norm = std::sqrt((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
  if (!(norm >= kShortestDirection) || !(norm <= kLongestDirection)) return std::nullopt;
  if (!std::isfinite(t[0]) || !std::isfinite(t[1]) || !std::isfinite(t[2])) return std::nullopt;
  if (!(scale > 0) || !std::isfinite(scale)) return std::nullopt;
  return Eigen::Quaterniond(q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm);
}

std::optional<RelativePose> relative_pose(const PlacedTree& a, const PlacedTree& b) noexcept {
  return relative(frame_of(a), frame_of(b));
}

std::optional<RelativePose> relative_pose(const Pose& a, double scale_a,
                                          const PlacedTree& b) noexcept {
  return relative(frame_of(a, scale_a), frame_of(b));
}

}  // namespace ist
