#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/time_of_impact.h>
#include <algorithm>

#include "c_api/structs.h"
#include "query/base/batch.h"
#include "query/base/relative_pose.h"

namespace ist::c_api {
namespace {

using c_api::read;

ist_status_t worse(ist_status_t a, ist_status_t b) noexcept {
  return std::min(a, b) < 0 ? std::min(a, b) : std::max(a, b);
}

ist_status_t check_capacity(const ist_contact_patches_t* given) noexcept {
  const ist_status_t status = check_size(given);
  if (status != IST_OK) return status;
  if (given->patch_size != sizeof(ist_contact_patch_t)) return IST_WRONG_SIZE;
  return given->patches == nullptr && given->capacity > 0 ? IST_NULL_POINTER : IST_OK;
}

std::span<ContactPatch> span_of(const ist_contact_patches_t& given) noexcept {
  return {reinterpret_cast<ContactPatch*>(given.patches), given.capacity};
}

/// `ask(a, b, settings, workspace, patches)` returns ContactPatches. `status`: of other arguments.
template <class Solid, class Ask>
ist_status_t find_patches(const ist_placed_t* a, const ist_placed_t* b,
                          const ist_contact_settings_t* given, ist_workspace_t* workspace,
                          ist_contact_patches_t* patches, ist_penetration_t* whole,
                          ist_status_t status, const Ask& ask) noexcept {
  if (status == IST_OK && whole != nullptr) status = check_size(whole);
  if (const ist_status_t size_status = check_size(patches); size_status == IST_OK)
    patches->count = 0;
  else if (status == IST_OK)
    status = size_status;
  if (status == IST_OK) status = check_capacity(patches);
  ContactSettings settings;
  if (status == IST_OK) status = read(given, settings);
  ist_status_t answered = IST_OK;
  if (status == IST_OK)
    status = ask_about<Solid>(a, b, workspace, [&](const auto& x, const auto& y, auto& scratch) {
      const ContactPatches found = ask(x, y, settings, scratch, span_of(*patches));
      patches->count = found.count;
      if (whole != nullptr) write(found.penetration, *whole);
      answered = status_of(found.penetration.status);
      return ist_status_t{IST_OK};
    });
  if (status == IST_OK) return answered;
  if (whole != nullptr && whole->size == sizeof *whole) refuse<Penetration>(status, *whole);
  return status;
}

/// `ask(a, b, workspace)` returns a YesNoAnswer.
template <class Ask>
ist_status_t find_overlap(const ist_placed_t* a, const ist_placed_t* b, ist_workspace_t* workspace,
                          ist_yes_no_t* answer, const Ask& ask) noexcept {
  static_assert(IST_UNKNOWN == static_cast<int>(YesNo::unknown));
  if (answer == nullptr) return IST_NULL_POINTER;
  *answer = IST_UNKNOWN;
  return ask_about<PlacedSolid>(a, b, workspace, [&](const auto& x, const auto& y, auto& scratch) {
    const YesNoAnswer found = ask(x, y, scratch);
    *answer = static_cast<ist_yes_no_t>(found.answer);
    return status_of(found.status);
  });
}

ist_status_t check_capacity(ist_outline_t* given) noexcept {
  const ist_status_t status = check_size(given);
  if (status != IST_OK) return status;
  given->total = given->count = 0;
  if (given->segment_size != sizeof(ist_outline_segment_t)) return IST_WRONG_SIZE;
  return given->segments == nullptr && given->capacity > 0 ? IST_NULL_POINTER : IST_OK;
}

/// Calls ask(placed, i) for each of `count`; returns the worst of their statuses.
template <class Ask>
ist_status_t ask_each(const ist_placed_t* given, std::size_t count, bool there,
                      const Ask& ask) noexcept {
  PlacedSolid solid;
  ist_status_t status = c_api::read(given, solid);
  if (status == IST_OK && count > 0 && !there) status = IST_NULL_POINTER;
  if (status != IST_OK) return status;
  for (std::size_t i = 0; i < count; ++i) status = std::min(status, ask(solid, i));
  return status;
}

bool is_finite(const Motion& motion) noexcept {
  return motion.velocity.allFinite() && motion.angular_velocity.allFinite() &&
         motion.about.allFinite();
}

/// The workspaces of the workers that answer pairs.
struct Staff {
  ist_workspace_t* workspaces;
  std::size_t workers;
  const ist_parallel_t* parallel;

  ist_status_t check() const noexcept {
    if (workers > 0 && workspaces == nullptr) return IST_NULL_POINTER;
    ist_status_t status = parallel == nullptr ? IST_OK : check_size(parallel);
    for (std::size_t i = 0; i < workers && status == IST_OK; ++i)
      workspace_of(workspaces + i, status);
    return status;
  }
};

/// Sets answers[i] to ask(i, workspace), or to `unknown` without workers. `Settings`: of C++, for
/// `given`.
template <class Settings, class Given, class Answer, class Unknown, class Ask>
ist_status_t answer_pairs(std::size_t count, const Given* given, const Staff& staff,
                          Answer* answers, std::size_t answer_size, const Unknown& unknown,
                          const Ask& ask) noexcept {
  if (count > 0 && answers == nullptr) return IST_NULL_POINTER;
  if (answer_size != sizeof(Answer)) return IST_WRONG_SIZE;
  Settings settings;
  ist_status_t status = read(given, settings);
  if (status == IST_OK) status = staff.check();
  if (status != IST_OK) return status;
  if (staff.workers == 0) {
    for (std::size_t i = 0; i < count; ++i) write(unknown, answers[i]);
    return IST_OK;
  }
  const ParallelFor threads = staff.parallel == nullptr
                                  ? ParallelFor{}
                                  : ParallelFor{staff.parallel->run, staff.parallel->pool};
  answer_all(count, staff.workers, threads, [&](std::size_t i, std::size_t worker) {
    answers[i].size = sizeof answers[i];
    // A pool with a wrong worker index is reported in the answer.
    ask(i, worker < staff.workers ? staff.workspaces + worker : nullptr);
  });
  return IST_OK;
}

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_penetration(const ist_placed_t* a, const ist_placed_t* b,
                             const ist_penetration_settings_t* settings, ist_workspace_t* workspace,
                             ist_penetration_t* answer) {
  return answer_with<ist::PenetrationSettings, ist::Penetration>(
      a, b, settings, workspace, answer,
      [](auto&&... asked) { return ist::penetration(asked...); });
}

ist_status_t ist_without_protrusion(const ist_penetration_t* whole, const ist_placed_t* a,
                                    const ist_placed_t* b, ist_penetration_t* answer) {
  ist_status_t status = check_size(whole);
  const ist::Penetration before = status == IST_OK ? read(*whole) : ist::Penetration{};
  const ist_status_t size_status = clear(answer);  // it may alias `whole`
  if (size_status != IST_OK) return size_status;
  ist::PlacedAsset first, second;
  if (status == IST_OK) status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  if (status != IST_OK) return refuse<ist::Penetration>(status, *answer);
  write(ist::without_protrusion(before, first, second), *answer);
  return answer->status;
}

ist_status_t ist_separation(const ist_placed_t* a, const ist_placed_t* b,
                            const ist_separation_settings_t* settings, ist_workspace_t* workspace,
                            ist_separation_t* answer) {
  return answer_with<ist::SeparationSettings, ist::Separation>(
      a, b, settings, workspace, answer, [](auto&&... asked) { return ist::separation(asked...); });
}

ist_status_t ist_overlap(const ist_placed_t* a, const ist_placed_t* b, ist_workspace_t* workspace,
                         ist_yes_no_t* answer) {
  return find_overlap(a, b, workspace, answer, [](const auto& x, const auto& y, auto& scratch) {
    return ist::overlap(x, y, scratch);
  });
}

ist_status_t ist_overlap_within(const ist_placed_t* a, const ist_placed_t* b, double margin,
                                ist_workspace_t* workspace, ist_yes_no_t* answer) {
  const ist_status_t status =
      find_overlap(a, b, workspace, answer, [&](const auto& x, const auto& y, auto& scratch) {
        return ist::overlap(x, y, margin, scratch);
      });
  return status == IST_OK && !(margin >= 0) ? IST_INVALID_INPUT : status;
}

ist_status_t ist_query(const ist_placed_t* a, const ist_placed_t* b,
                       const ist_penetration_settings_t* penetration_settings,
                       const ist_separation_settings_t* separation_settings,
                       ist_workspace_t* workspace, ist_penetration_t* penetration,
                       ist_separation_t* separation) {
  const ist_status_t penetration_status = check_size(penetration),
                     separation_status = check_size(separation);
  ist_status_t status = worse(penetration_status, separation_status);
  ist::QuerySettings settings;
  if (status == IST_OK)
    status = worse(read(penetration_settings, settings.penetration),
                   read(separation_settings, settings.separation));
  if (status == IST_OK)
    status = ask_about<ist::PlacedSolid>(
        a, b, workspace, [&](const auto& x, const auto& y, auto& scratch) {
          const ist::PenetrationAndSeparation both = ist::query(x, y, settings, scratch);
          write(both.penetration, *penetration);
          write(both.separation, *separation);
          return ist_status_t{IST_OK};
        });
  if (status == IST_OK) return worse(penetration->status, separation->status);
  if (penetration_status == IST_OK) refuse<ist::Penetration>(status, *penetration);
  if (separation_status == IST_OK) refuse<ist::Separation>(status, *separation);
  return status;
}

ist_status_t ist_contact_patches(const ist_placed_t* a, const ist_placed_t* b,
                                 const ist_contact_settings_t* settings, ist_workspace_t* workspace,
                                 ist_contact_patches_t* patches, ist_penetration_t* whole) {
  return find_patches<ist::PlacedSolid>(
      a, b, settings, workspace, patches, whole, IST_OK,
      [](auto&&... asked) { return ist::contact_patches(asked...); });
}

ist_status_t ist_overlap_outline(const ist_placed_t* a, const ist_placed_t* b,
                                 const ist_contact_settings_t* settings, ist_workspace_t* workspace,
                                 ist_contact_patches_t* patches, ist_outline_t* outline,
                                 ist_penetration_t* whole) {
  const auto ask = [&](const auto& x, const auto& y, const ist::ContactSettings& by,
                       ist::Workspace& scratch, std::span<ist::ContactPatch> out) {
    const ist::OverlapOutline found = ist::overlap_outline(
        x, y, by, scratch, out,
        {reinterpret_cast<ist::OutlineSegment*>(outline->segments), outline->capacity});
    outline->total = found.segments;
    outline->count = std::min(found.segments, outline->capacity);
    return found.contact;
  };
  return find_patches<ist::PlacedAsset>(a, b, settings, workspace, patches, whole,
                                        check_capacity(outline), ask);
}

ist_status_t ist_patches_without_protrusion(const ist_placed_t* a, const ist_placed_t* b,
                                            const ist_contact_settings_t* settings,
                                            ist_contact_patches_t* patches) {
  ist_status_t status = check_capacity(patches);
  if (status == IST_OK && patches->count > patches->capacity) status = IST_INVALID_INPUT;
  ist::PlacedAsset first, second;
  if (status == IST_OK) status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  ist::ContactSettings found_with;
  if (status == IST_OK) status = read(settings, found_with);
  if (status == IST_OK && !ist::relative_pose(first, second)) status = IST_INVALID_INPUT;
  if (status != IST_OK) return status;
  ist::without_protrusion(span_of(*patches).first(patches->count), first, second, found_with);
  return IST_OK;
}

ist_status_t ist_raycast(const ist_placed_t* solid, const ist_ray_t* rays, size_t count,
                         ist_ray_hit_t* hits, size_t hit_size) {
  if (hit_size != sizeof(ist_ray_hit_t)) return IST_WRONG_SIZE;
  return ask_each(solid, count, rays != nullptr && hits != nullptr,
                  [&](const auto& placed, std::size_t i) {
                    write(ist::raycast(placed, read(rays[i])), hits[i]);
                    return hits[i].status;
                  });
}

ist_status_t ist_closest_point(const ist_placed_t* solid, const double* points, size_t count,
                               ist_surface_point_t* answers, size_t answer_size) {
  if (answer_size != sizeof(ist_surface_point_t)) return IST_WRONG_SIZE;
  return ask_each(solid, count, points != nullptr && answers != nullptr,
                  [&](const auto& placed, std::size_t i) {
                    const double* const x = points + 3 * i;
                    write(ist::closest_point(placed, {x[0], x[1], x[2]}), answers[i]);
                    return answers[i].status;
                  });
}

ist_status_t ist_contains(const ist_placed_t* solid, const double* points, size_t count,
                          ist_yes_no_t* inside) {
  return ask_each(solid, count, points != nullptr && inside != nullptr,
                  [&](const auto& placed, std::size_t i) {
                    const double* const x = points + 3 * i;
                    const ist::YesNoAnswer found = ist::contains(placed, {x[0], x[1], x[2]});
                    inside[i] = static_cast<ist_yes_no_t>(found.answer);
                    return status_of(found.status);
                  });
}

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
  *end = {};  // it may alias `start`
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

ist_status_t ist_penetration_batch(const ist_pair_t* pairs, std::size_t count,
                                   const ist_penetration_settings_t* settings,
                                   ist_workspace_t* workspaces, std::size_t workers,
                                   ist_penetration_t* answers, std::size_t answer_size,
                                   const ist_parallel_t* parallel) {
  if (count > 0 && pairs == nullptr) return IST_NULL_POINTER;
  return answer_pairs<ist::PenetrationSettings>(
      count, settings, {workspaces, workers, parallel}, answers, answer_size,
      ist::unknown_penetration(), [&](std::size_t i, ist_workspace_t* scratch) {
        ist_penetration(pairs[i].a, pairs[i].b, settings, scratch, answers + i);
      });
}

ist_status_t ist_separation_batch(const ist_pair_t* pairs, std::size_t count,
                                  const ist_separation_settings_t* settings,
                                  ist_workspace_t* workspaces, std::size_t workers,
                                  ist_separation_t* answers, std::size_t answer_size,
                                  const ist_parallel_t* parallel) {
  if (count > 0 && pairs == nullptr) return IST_NULL_POINTER;
  return answer_pairs<ist::SeparationSettings>(
      count, settings, {workspaces, workers, parallel}, answers, answer_size,
      ist::unknown_separation(), [&](std::size_t i, ist_workspace_t* scratch) {
        ist_separation(pairs[i].a, pairs[i].b, settings, scratch, answers + i);
      });
}

ist_status_t ist_contact_patches_batch(const ist_pair_t* pairs, std::size_t count,
                                       const ist_contact_settings_t* settings,
                                       ist_workspace_t* workspaces, std::size_t workers,
                                       ist_contact_patches_t* patches, ist_penetration_t* wholes,
                                       std::size_t whole_size, const ist_parallel_t* parallel) {
  if (count > 0 && (pairs == nullptr || patches == nullptr)) return IST_NULL_POINTER;
  // All must have one size, since it gives the distance between elements.
  for (std::size_t i = 0; i < count; ++i) {
    const ist_status_t status = check_size(patches + i);
    if (status != IST_OK) return status;
    patches[i].count = 0;
  }
  return answer_pairs<ist::ContactSettings>(
      count, settings, {workspaces, workers, parallel}, wholes, whole_size,
      ist::unknown_penetration(), [&](std::size_t i, ist_workspace_t* scratch) {
        ist_contact_patches(pairs[i].a, pairs[i].b, settings, scratch, patches + i, wholes + i);
      });
}
