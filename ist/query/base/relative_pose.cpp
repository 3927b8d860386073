#include "query/base/relative_pose.h"

namespace ist {
namespace {

std::optional<RelativePose> relative(const AssetFrame& frame_a, const Pose& a, double scale_a,
                                     const PlacedAsset& b) {
  std::optional<RelativePose> pose(std::in_place);
  if (b.asset.empty() ||
      !pose->place(frame_a, a, scale_a, frame_of(b.asset.header()), b.pose, b.scale))
    pose.reset();
  return pose;
}

}  // namespace

std::optional<Eigen::Quaterniond> usable_rotation(const Pose& pose, double scale) noexcept {
  if (!usable(Rotation::of(pose.q), pose.t, scale)) return std::nullopt;
  return unit_rotation(pose);
}

std::optional<RelativePose> relative_pose(const PlacedAsset& a, const PlacedAsset& b) noexcept {
  if (a.asset.empty()) return std::nullopt;
  return relative(frame_of(a.asset.header()), a.pose, a.scale, b);
}

std::optional<RelativePose> relative_pose(const Pose& a, double scale_a,
                                          const PlacedAsset& b) noexcept {
  return relative({{0, 0, 0}, 1}, a, scale_a, b);
}

}  // namespace ist
