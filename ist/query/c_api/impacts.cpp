#include <ist/time_of_impact.h>

#include "query/base/relative_pose.h"
#include "query/c_api/ask.h"

namespace ist::c_api {
namespace {

using c_api::read;

Motion read(const ist_motion_t* given) noexcept {
  if (given == nullptr) return {};
  return {vector(given->velocity), vector(given->angular_velocity), vector(given->about)};
}

template <class Solid>
ist_status_t find_impact(const Solid* a, const ist_placed_tree_t* b, const ist_motion_t* motion_a,
                         const ist_motion_t* motion_b, const ist_impact_settings_t* given,
                         ist_workspace_t* workspace, ist_impact_t* answer) noexcept {
  return answer_with<ImpactSettings, TimeOfImpact>(
      a, b, given, workspace, answer,
      [&](const auto& x, const auto& y, const ImpactSettings& settings, Workspace& scratch) {
        return time_of_impact(x, y, {read(motion_a), read(motion_b)}, settings, scratch);
      });
}

bool is_finite(const Motion& motion) noexcept {
  return motion.velocity.allFinite() && motion.angular_velocity.allFinite() &&
         motion.about.allFinite();
}

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_motion_between(const ist_pose_t* from, const ist_pose_t* to, double duration,
                                const double about[3], double scale, ist_motion_t* motion) {
  if (motion == nullptr) return IST_NULL_POINTER;
  *motion = {};
  if (from == nullptr || to == nullptr) return IST_NULL_POINTER;
  const Eigen::Vector3d centre =
      about == nullptr ? Eigen::Vector3d::Zero() : Eigen::Vector3d(about);
  const ist::Motion found =
      ist::motion_between(pose(*from), pose(*to), duration, centre, scale == 0 ? 1 : scale);
  if (!is_finite(found)) return IST_INVALID_INPUT;
  write(found.velocity, motion->velocity);
  write(found.angular_velocity, motion->angular_velocity);
  write(found.about, motion->about);
  return IST_OK;
}

ist_status_t ist_moved(const ist_pose_t* start, double scale, const ist_motion_t* motion,
                       double time, ist_pose_t* end) {
  if (end == nullptr) return IST_NULL_POINTER;
  ist::PlacedTree object;
  if (start != nullptr) object.pose = pose(*start);
  *end = {};  // which may be `start`
  if (start == nullptr || motion == nullptr) return IST_NULL_POINTER;
  object.scale = scale == 0 ? 1 : scale;
  object = ist::moved(object, read(motion), time);
  if (!ist::usable_rotation(object.pose, object.scale)) return IST_INVALID_INPUT;
  write(object.pose, *end);
  return IST_OK;
}

ist_status_t ist_time_of_impact(const ist_placed_tree_t* a, const ist_placed_tree_t* b,
                                const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                                const ist_impact_settings_t* settings, ist_workspace_t* workspace,
                                ist_impact_t* answer) {
  return find_impact(a, b, motion_a, motion_b, settings, workspace, answer);
}

ist_status_t ist_field_time_of_impact(const ist_placed_field_t* a, const ist_placed_tree_t* b,
                                      const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                                      const ist_impact_settings_t* settings,
                                      ist_workspace_t* workspace, ist_impact_t* answer) {
  return find_impact(a, b, motion_a, motion_b, settings, workspace, answer);
}
