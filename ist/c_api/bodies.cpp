#include <ist/contact_law.h>
#include <ist/mass_properties.h>
#include <cmath>
#include <cstring>

#include "c_api/structs.h"
#include "query/base/relative_pose.h"

namespace ist::c_api {
namespace {

using c_api::write;

void write(const MassProperties& found, ist_mass_properties_t& out) noexcept {
  out.volume = found.volume;
  write(found.centre_of_mass, out.centre_of_mass);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) out.inertia[i][k] = found.inertia(i, k);
  out.volume_error = found.volume_error;
  out.centre_of_mass_error = found.centre_of_mass_error;
  out.inertia_error = found.inertia_error;
}

void write(const Bounds& found, ist_bounds_t& out) noexcept {
  write(found.lower, out.lower);
  write(found.upper, out.upper);
  write(found.centre, out.centre);
  out.radius = found.radius;
}

/// Reads a placed asset like queries, and refuses the same poses.
ist_status_t read_usable(const ist_placed_t* given, PlacedAsset& placed) noexcept {
  const ist_status_t status = c_api::read(given, placed);
  if (status != IST_OK) return status;
  return usable_rotation(placed.pose, placed.scale) ? IST_OK : IST_INVALID_INPUT;
}

/// Writes the result of `find(solid)` for a solid that `read(given, solid)` reads.
template <class Solid, class Given, class Read, class Find, class Answer>
ist_status_t tell(const Given* given, const Read& read, const Find& find, Answer* answer) noexcept {
  ist_status_t status = clear(answer);
  if (status != IST_OK) return status;
  Solid solid;
  status = read(given, solid);
  if (status == IST_OK || status == IST_INVALID_INPUT) write(find(solid), *answer);
  return answer->status = status;
}

const auto kMassProperties = [](const auto& solid) noexcept { return mass_properties(solid); };
const auto kBounds = [](const auto& solid) noexcept { return bounds(solid); };

Wrench wrench_on_b(const ist_penetration_t& contact) noexcept {
  return {vector(contact.force), vector(contact.torque)};
}
Wrench wrench_on_b(const ist_contact_patch_t& patch) noexcept {
  return {vector(patch.force), vector(patch.torque)};
}

ist_status_t check(const ist_penetration_t* contact) noexcept { return check_size(contact); }
ist_status_t check(const ist_contact_patch_t* patch) noexcept {
  return patch == nullptr ? IST_NULL_POINTER : IST_OK;
}

template <class Contact>
ist_status_t find_wrenches(const Contact* contact, const ist_pose_t* b, const double* point_a,
                           const double* point_b, ist_wrenches_t* out) noexcept {
  ist_status_t status = clear(out);
  if (status == IST_OK) status = check(contact);
  if (status != IST_OK) return status;
  if (b == nullptr || point_a == nullptr || point_b == nullptr) return IST_NULL_POINTER;
  const Wrenches found = both_wrenches(wrench_on_b(*contact), vector(b->t),
                                       Eigen::Vector3d(point_a), Eigen::Vector3d(point_b));
  write(found.on_a.force, out->on_a.force);
  write(found.on_a.torque, out->on_a.torque);
  write(found.on_b.force, out->on_b.force);
  write(found.on_b.torque, out->on_b.torque);
  return IST_OK;
}

Penetration with_wrench(const Wrench& on_b) noexcept {
  Penetration contact;
  contact.force = on_b.force;
  contact.torque = on_b.torque;
  return contact;
}

template <class Contact>
ist_status_t find_rate(const Contact* contact, const ist_placed_t* a, const ist_placed_t* b,
                       const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                       double* rate) noexcept {
  if (rate == nullptr) return IST_NULL_POINTER;
  *rate = 0;
  ist_status_t status = check(contact);
  PlacedSolid solid_a, solid_b;
  if (status == IST_OK) status = c_api::read(a, solid_a);
  if (status == IST_OK) status = c_api::read(b, solid_b);
  if (status == IST_OK)
    *rate = volume_rate(with_wrench(wrench_on_b(*contact)), solid_a, solid_b, c_api::read(motion_a),
                        c_api::read(motion_b));
  return status;
}

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_asset_get_mass_properties(const ist_asset_t* asset,
                                           ist_mass_properties_t* properties) {
  return tell<ist::AssetView>(asset, view_of, kMassProperties, properties);
}

ist_status_t ist_asset_get_bounds(const ist_asset_t* asset, ist_bounds_t* bounds) {
  return tell<ist::AssetView>(asset, view_of, kBounds, bounds);
}

ist_status_t ist_placed_mass_properties(const ist_placed_t* placed,
                                        ist_mass_properties_t* properties) {
  return tell<ist::PlacedAsset>(placed, read_usable, kMassProperties, properties);
}

ist_status_t ist_placed_bounds(const ist_placed_t* placed, ist_bounds_t* bounds) {
  return tell<ist::PlacedAsset>(placed, read_usable, kBounds, bounds);
}

ist_status_t ist_wrenches(const ist_penetration_t* contact, const ist_pose_t* b,
                          const double point_a[3], const double point_b[3],
                          ist_wrenches_t* wrenches) {
  return find_wrenches(contact, b, point_a, point_b, wrenches);
}

ist_status_t ist_patch_wrenches(const ist_contact_patch_t* patch, const ist_pose_t* b,
                                const double point_a[3], const double point_b[3],
                                ist_wrenches_t* wrenches) {
  return find_wrenches(patch, b, point_a, point_b, wrenches);
}

ist_status_t ist_volume_rate(const ist_penetration_t* contact, const ist_placed_t* a,
                             const ist_placed_t* b, const ist_motion_t* motion_a,
                             const ist_motion_t* motion_b, double* rate) {
  return find_rate(contact, a, b, motion_a, motion_b, rate);
}

ist_status_t ist_patch_volume_rate(const ist_contact_patch_t* patch, const ist_placed_t* a,
                                   const ist_placed_t* b, const ist_motion_t* motion_a,
                                   const ist_motion_t* motion_b, double* rate) {
  return find_rate(patch, a, b, motion_a, motion_b, rate);
}

ist_status_t ist_get_size_match(const ist_placed_t* a, const ist_placed_t* b,
                                ist_size_match_t* fit) {
  ist_status_t status = clear(fit);
  if (status != IST_OK) return status;
  ist::PlacedAsset first, second;
  status = read_usable(a, first);
  if (status == IST_OK) status = read_usable(b, second);
  fit->status = status;
  if (status != IST_OK) return status;
  const ist::SizeMatch found = ist::size_match(first, second);
  fit->feature_size_a = found.feature_size_a;
  fit->feature_size_b = found.feature_size_b;
  fit->ratio = found.ratio;
  fit->a_is_coarser = found.a_is_coarser ? 1 : 0;
  fit->has_mesh = found.has_mesh ? 1 : 0;
  fit->needs_mesh = found.needs_mesh ? 1 : 0;
  fit->fits = found.fits() ? 1 : 0;
  return IST_OK;
}

ist_status_t ist_contact_force(const ist_contact_law_t* law, const ist_contact_patch_t* patches,
                               std::size_t count, const ist_placed_t* a, const ist_placed_t* b,
                               const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                               double step, ist_contact_memory_t* memory,
                               ist_contact_force_t* force) {
  static_assert(sizeof(ist_contact_memory_t) == sizeof(ist::ContactMemory) &&
                offsetof(ist_contact_memory_t, count) == offsetof(ist::ContactMemory, count) &&
                sizeof(ist_patch_memory_t) == sizeof(ist::PatchMemory) &&
                offsetof(ist_patch_memory_t, stretch) == offsetof(ist::PatchMemory, stretch));
  ist_status_t status = clear(force);
  if (status == IST_OK) status = check_size(law);
  if (status != IST_OK) return status;
  if ((patches == nullptr && count > 0) || memory == nullptr) return IST_NULL_POINTER;
  ist::PlacedSolid solid_a, solid_b;
  status = ist::c_api::read(a, solid_a);
  if (status == IST_OK) status = ist::c_api::read(b, solid_b);
  if (status != IST_OK) return status;
  const ist::ContactLaw given = {
      law->stiffness,       law->area, law->damping, law->friction, law->friction_stiffness,
      law->friction_damping};
  for (const double number : {given.area, given.damping, given.friction, given.friction_stiffness,
                              given.friction_damping, step})
    if (!(number >= 0 && std::isfinite(number))) return IST_INVALID_INPUT;
  if (!(given.stiffness > 0 && std::isfinite(given.stiffness)) ||
      memory->count > ist::ContactMemory::kPatches)
    return IST_INVALID_INPUT;
  // Both memories are plain numbers in the same layout.
  ist::ContactMemory kept;
  std::memcpy(static_cast<void*>(&kept), memory, sizeof kept);
  const ist::ContactForce found =
      ist::contact_force(given, {reinterpret_cast<const ist::ContactPatch*>(patches), count},
                         ist::relative_motion(solid_a, solid_b, ist::c_api::read(motion_a),
                                              ist::c_api::read(motion_b)),
                         vector(b->pose.t), step, kept);
  std::memcpy(memory, &kept, sizeof kept);
  write(found.force, force->force);
  write(found.torque, force->torque);
  force->normal_force = found.normal_force;
  force->energy = found.energy;
  return IST_OK;
}
