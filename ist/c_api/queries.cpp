#include <ist/query.h>
#include <algorithm>

#include "c_api/structs.h"
#include "query/base/relative_pose.h"

namespace ist::c_api {
namespace {

using c_api::read;

ist_status_t worse(ist_status_t a, ist_status_t b) noexcept {
  return std::min(a, b) < 0 ? std::min(a, b) : std::max(a, b);
}

ist_status_t check_room(const ist_contact_patches_t* given) noexcept {
  const ist_status_t status = check_size(given);
  if (status != IST_OK) return status;
  if (given->patch_size != sizeof(ist_contact_patch_t)) return IST_WRONG_SIZE;
  return given->patches == nullptr && given->capacity > 0 ? IST_NULL_POINTER : IST_OK;
}

std::span<ContactPatch> room_of(const ist_contact_patches_t& given) noexcept {
  return {reinterpret_cast<ContactPatch*>(given.patches), given.capacity};
}

/// `ask(a, b, settings, workspace, patches)` answers ContactPatches. `status`: of other arguments.
template <class Solid, class Ask>
ist_status_t find_patches(const ist_placed_t* a, const ist_placed_t* b,
                          const ist_contact_settings_t* given, ist_workspace_t* workspace,
                          ist_contact_patches_t* patches, ist_penetration_t* whole,
                          ist_status_t status, const Ask& ask) noexcept {
  if (status == IST_OK && whole != nullptr) status = check_size(whole);
  if (const ist_status_t room = check_size(patches); room == IST_OK)
    patches->count = 0;
  else if (status == IST_OK)
    status = room;
  if (status == IST_OK) status = check_room(patches);
  ContactSettings settings;
  if (status == IST_OK) status = read(given, settings);
  ist_status_t answered = IST_OK;
  if (status == IST_OK)
    status = ask_about<Solid>(a, b, workspace, [&](const auto& x, const auto& y, auto& scratch) {
      const ContactPatches found = ask(x, y, settings, scratch, room_of(*patches));
      patches->count = found.count;
      if (whole != nullptr) write(found.penetration, *whole);
      answered = status_of(found.penetration.status);
      return ist_status_t{IST_OK};
    });
  if (status == IST_OK) return answered;
  if (whole != nullptr && whole->size == sizeof *whole) refuse<Penetration>(status, *whole);
  return status;
}

/// `ask(a, b, workspace)` gives a YesNoAnswer.
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

ist_status_t check_room(ist_outline_t* given) noexcept {
  const ist_status_t status = check_size(given);
  if (status != IST_OK) return status;
  given->total = given->count = 0;
  if (given->segment_size != sizeof(ist_outline_segment_t)) return IST_WRONG_SIZE;
  return given->segments == nullptr && given->capacity > 0 ? IST_NULL_POINTER : IST_OK;
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
  const ist_status_t room = clear(answer);  // which may be `whole`
  if (room != IST_OK) return room;
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
  const ist_status_t room = check_size(penetration), other_room = check_size(separation);
  ist_status_t status = worse(room, other_room);
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
  if (room == IST_OK) refuse<ist::Penetration>(status, *penetration);
  if (other_room == IST_OK) refuse<ist::Separation>(status, *separation);
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
                       ist::Workspace& scratch, std::span<ist::ContactPatch> room) {
    const ist::OverlapOutline found = ist::overlap_outline(
        x, y, by, scratch, room,
        {reinterpret_cast<ist::OutlineSegment*>(outline->segments), outline->capacity});
    outline->total = found.segments;
    outline->count = std::min(found.segments, outline->capacity);
    return found.contact;
  };
  return find_patches<ist::PlacedAsset>(a, b, settings, workspace, patches, whole,
                                        check_room(outline), ask);
}

ist_status_t ist_patches_without_protrusion(const ist_placed_t* a, const ist_placed_t* b,
                                            const ist_contact_settings_t* settings,
                                            ist_contact_patches_t* patches) {
  ist_status_t status = check_room(patches);
  if (status == IST_OK && patches->count > patches->capacity) status = IST_INVALID_INPUT;
  ist::PlacedAsset first, second;
  if (status == IST_OK) status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  ist::ContactSettings found_with;
  if (status == IST_OK) status = read(settings, found_with);
  if (status == IST_OK && !ist::relative_pose(first, second)) status = IST_INVALID_INPUT;
  if (status != IST_OK) return status;
  ist::without_protrusion(room_of(*patches).first(patches->count), first, second, found_with);
  return IST_OK;
}
