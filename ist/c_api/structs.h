#pragma once

#include <ist/c.h>
#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>
#include <algorithm>
#include <cstring>
#include <type_traits>

#include "c_api/handles.h"
#include "query/base/members.h"
#include "query/base/no_answer.h"

// Conversion of C structs to and from C++: checked, then copied number by number.

namespace ist::c_api {

/// True if a struct is not null and has a size that this library knows.
template <class T>
ist_status_t check_size(const T* given) noexcept {
  if (given == nullptr) return IST_NULL_POINTER;
  return given->size == sizeof(T) ? IST_OK : IST_WRONG_SIZE;
}

/// Clears an answer except its size.
template <class T>
ist_status_t clear(T* answer) noexcept {
  const ist_status_t status = check_size(answer);
  if (status == IST_OK) {
    *answer = T{};
    answer->size = sizeof(T);
  }
  return status;
}

inline Eigen::Vector3d vector(const double (&v)[3]) noexcept { return {v[0], v[1], v[2]}; }
inline void write(const Eigen::Vector3d& v, double (&out)[3]) noexcept {
  for (int k = 0; k < 3; ++k) out[k] = v[k];
}

inline Pose pose(const ist_pose_t& given) noexcept {
  const auto& [q, t] = given;
  return {{q[0], q[1], q[2], q[3]}, {t[0], t[1], t[2]}};
}
inline void write(const Pose& found, ist_pose_t& out) noexcept {
  std::copy_n(found.q, 4, out.q);
  std::copy_n(found.t, 3, out.t);
}

/// Indexed by QueryStatus.
inline constexpr ist_status_t kStatuses[] = {IST_OK, IST_BUDGET_EXHAUSTED, IST_INVALID_INPUT,
                                             IST_MISSING_DATA, IST_ERROR_EXCEEDED};
inline ist_status_t status_of(QueryStatus status) noexcept {
  return kStatuses[static_cast<std::uint32_t>(status)];
}
inline QueryStatus query_status(ist_status_t status) noexcept {
  const auto* const found = std::find(std::begin(kStatuses), std::end(kStatuses), status);
  return found == std::end(kStatuses) ? QueryStatus::invalid_input
                                      : static_cast<QueryStatus>(found - kStatuses);
}

// The statuses of invalid asset bytes are in the same order in both, descending.
static_assert(IST_TOO_SHORT - IST_CORRUPT_LAYOUT == static_cast<int>(AssetStatus::corrupt_layout) -
                                                        static_cast<int>(AssetStatus::too_short));
inline ist_status_t status_of(AssetStatus status) noexcept {
  return status == AssetStatus::ok ? IST_OK : IST_TOO_SHORT + 1 - static_cast<int>(status);
}
/// For a status from IST_TOO_SHORT to IST_CORRUPT_LAYOUT.
inline AssetStatus asset_status_of(ist_status_t status) noexcept {
  return static_cast<AssetStatus>(IST_TOO_SHORT + 1 - status);
}

/// Copies an answer from C++ to C or back. Padding is set to 0, so that the bytes can be compared.
template <class From, class To>
requires requires(From from, To to) { from.status, to.status; }
void write(const From& from, To& to) noexcept {
  if constexpr (requires { to.size; }) {
    std::memset(&to, 0, sizeof to);
    to.size = sizeof to;
  }
  static_assert(IST_IMPACT_OVERLAPPING == static_cast<int>(ImpactKind::overlapping));
  for_each_member(
      []<class X, class Y>(const X& x, Y& y) {
        if constexpr (std::is_same_v<Y, QueryStatus>)
          y = query_status(x);
        else if constexpr (std::is_same_v<X, ImpactKind>)
          y = static_cast<ist_impact_kind_t>(x);
        else if constexpr (std::is_enum_v<X>)
          y = status_of(x);
        else if constexpr (std::is_same_v<Y, Eigen::Vector3d>)
          y = vector(x);
        else if constexpr (std::is_array_v<Y>)
          write(x, y);
        else
          y = x;
      },
      from, to);
}

/// The shape of a function points to the caller's struct, which is read for every sample.
ist_status_t read(const ist_placed_t* given, PlacedSolid& placed) noexcept;
/// Reads an asset: IST_MISSING_DATA for a shape.
ist_status_t read(const ist_placed_t* given, PlacedAsset& placed) noexcept;

ist_status_t read(const ist_penetration_settings_t* given, PenetrationSettings& settings) noexcept;
ist_status_t read(const ist_separation_settings_t* given, SeparationSettings& settings) noexcept;
ist_status_t read(const ist_impact_settings_t* given, ImpactSettings& settings) noexcept;

inline Ray read(const ist_ray_t& given) noexcept {
  Ray ray{vector(given.origin), vector(given.direction)};
  if (given.max_distance != 0) ray.max_distance = given.max_distance;
  return ray;
}
/// Null means at rest.
inline Motion read(const ist_motion_t* given) noexcept {
  if (given == nullptr) return {};
  return {vector(given->velocity), vector(given->angular_velocity), vector(given->about)};
}
inline Penetration read(const ist_penetration_t& given) noexcept {
  Penetration result;
  write(given, result);
  return result;
}

// Patches are written directly to the caller's array.
static_assert(std::is_standard_layout_v<ContactPatch>);
static_assert(sizeof(ist_contact_patch_t) == sizeof(ContactPatch));
static_assert(offsetof(ist_contact_patch_t, id) == offsetof(ContactPatch, id));
static_assert(offsetof(ist_contact_patch_t, centroid) == offsetof(ContactPatch, centroid));
static_assert(offsetof(ist_contact_patch_t, normal) == offsetof(ContactPatch, normal));
static_assert(offsetof(ist_contact_patch_t, area) == offsetof(ContactPatch, area));
static_assert(offsetof(ist_contact_patch_t, depth) == offsetof(ContactPatch, depth));
static_assert(offsetof(ist_contact_patch_t, volume) == offsetof(ContactPatch, volume));
static_assert(offsetof(ist_contact_patch_t, force) == offsetof(ContactPatch, force));
static_assert(offsetof(ist_contact_patch_t, torque) == offsetof(ContactPatch, torque));
static_assert(offsetof(ist_contact_patch_t, point) == offsetof(ContactPatch, point));
static_assert(offsetof(ist_contact_patch_t, torsion) == offsetof(ContactPatch, torsion));

static_assert(std::is_standard_layout_v<OutlineSegment>);
static_assert(sizeof(ist_outline_segment_t) == sizeof(OutlineSegment));
static_assert(offsetof(ist_outline_segment_t, from) == offsetof(OutlineSegment, from));
static_assert(offsetof(ist_outline_segment_t, to) == offsetof(OutlineSegment, to));
static_assert(offsetof(ist_outline_segment_t, patch) == offsetof(OutlineSegment, patch));

/// Reads the arguments common to all queries, then runs `ask(a, b, workspace)`, which returns its
/// status. `Solid`: PlacedSolid, or PlacedAsset for queries of assets only.
template <class Solid, class Ask>
ist_status_t ask_about(const ist_placed_t* a, const ist_placed_t* b, ist_workspace_t* workspace,
                       const Ask& ask) noexcept {
  Solid first, second;
  ist_status_t status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  if (status != IST_OK) return status;
  Workspace* const scratch = workspace_of(workspace, status);
  return scratch == nullptr ? status : ask(first, second, *scratch);
}

/// The answer of a refused query: all numbers are NaN, like those of an unanswerable one.
template <class Found, class Answer>
ist_status_t refuse(ist_status_t status, Answer& answer) noexcept {
  write(invalid_input<Found>(), answer);
  return answer.status = status;
}

/// A query with settings and one answer: `ask(a, b, settings, workspace)` returns it, a `Found`.
template <class Settings, class Found, class Given, class Answer, class Ask>
ist_status_t answer_with(const ist_placed_t* a, const ist_placed_t* b, const Given* given,
                         ist_workspace_t* workspace, Answer* answer, const Ask& ask) noexcept {
  ist_status_t status = check_size(answer);
  if (status != IST_OK) return status;
  Settings settings;
  status = read(given, settings);
  if (status == IST_OK)
    status =
        ask_about<PlacedSolid>(a, b, workspace, [&](const auto& x, const auto& y, auto& scratch) {
          write(ask(x, y, settings, scratch), *answer);
          return ist_status_t{IST_OK};
        });
  return status == IST_OK ? answer->status : refuse<Found>(status, *answer);
}

}  // namespace ist::c_api
