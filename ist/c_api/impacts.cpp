#include <ist/time_of_impact.h>

#include "c_api/structs.h"
#include "query/base/relative_pose.h"

namespace ist::c_api {
namespace {

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
  const ist::Pose from = start == nullptr ? ist::Pose() : pose(*start);
  *end = {};  // which may be `start`
  if (start == nullptr || motion == nullptr) return IST_NULL_POINTER;
  if (scale == 0) scale = 1;
  const ist::Pose to = ist::moved(from, read(motion), time, scale);
  if (!ist::usable_rotation(to, scale)) return IST_INVALID_INPUT;
  write(to, *end);
  return IST_OK;
}

ist_status_t ist_time_of_impact(const ist_placed_t* a, const ist_placed_t* b,
                                const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                                const ist_impact_settings_t* settings, ist_workspace_t* workspace,
                                ist_impact_t* answer) {
  return answer_with<ist::ImpactSettings, ist::TimeOfImpact>(
      a, b, settings, workspace, answer,
      [&](const auto& x, const auto& y, const ist::ImpactSettings& by, ist::Workspace& scratch) {
        return ist::time_of_impact(x, y, {read(motion_a), read(motion_b)}, by, scratch);
      });
}
