#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "query/base/no_answer.h"
#include "query/base/solid_bounds.h"
#include "query/contact/write_patches.h"
#include "query/exact/exact_in_world.h"
#include "query/exact/exact_parts.h"
#include "query/exact/keep_largest.h"
#include "query/exact/kept_mesh.h"
#include "query/scratch/workspace.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

template <class Query>
Query query_of(const PlacedAsset& a, const MeshTree& mesh_a, const PlacedAsset& b,
               const MeshTree& mesh_b, const RelativePose& pose, ExactScratch& scratch) {
  const double moved_b =
      moved_by_poses(a, b, mesh_b, pose) + pose.a_from_b.scale * moved_in_mesh(mesh_b);
  return {mesh_a, moved_in_mesh(mesh_a), mesh_b, moved_b, pose.a_from_b, pose.b_from_a, scratch};
}

ExactInWorld in_world(const ExactSums& sums, const exact::Point& origin, const PairPlace& place) {
  return {sums.volume(), sums.moment, sums.force, sums.torque, origin, place};
}

Penetration whole_answer(const ExactOverlap& found, const PlacedAsset& a, const PlacedAsset& b,
                         const RelativePose& pose) {
  const ExactInWorld sums = in_world(found.sums, found.origin, pose);
  Penetration answer;
  answer.volume = std::max(0.0, sums.volume);
  const double error = found.error * pose.unit3() + (answer.volume - sums.volume);
  answer.volume_min = std::max(0.0, answer.volume - error);
  answer.volume_max = answer.volume + error;
  // No overlap is larger than the smaller solid.
  const double most = smaller_volume(a, b);
  for (double* const volume : {&answer.volume, &answer.volume_min, &answer.volume_max})
    *volume = std::min(*volume, most);
  if (answer.volume > 0) answer.centroid = vector(sums.centroid);
  if (found.contact.area > 0)
    answer.centroid = pose.to_world(1 / found.contact.area * vector(found.contact.moment));
  answer.force = -vector(sums.force);
  answer.torque = -vector(sums.torque);
  answer.touching = found.contact.touching;
  answer.contact_area = found.contact.area * (pose.unit_a * pose.unit_a);
  // Normals that cancel leave the rounding of areas.
  const Eigen::Vector3d normal = vector(found.contact.normal);
  if (normal.norm() > 1e-9 * found.contact.area)
    answer.contact_normal = pose.rotation() * normal.normalized();
  answer.node_visits = found.visits;
  answer.sphere_pairs = found.crossings;
  return answer;
}

/// The settings for the spheres' answer, which replaces an exact one that a limit stopped.
template <class Settings>
Settings settings_of_spheres(Settings settings) {
  settings.measure = Measure::matched;
  settings.spheres_only = true;
  settings.relative_error = 0;
  return settings;
}

Penetration stopped(const PlacedAsset& a, const PlacedAsset& b, Penetration by_spheres) {
  bound_by_solids(a, b, by_spheres);
  by_spheres.status = QueryStatus::budget_exhausted;
  return by_spheres;
}

/// Writes the kept parts in their order; `kept` becomes the patch.
std::size_t write_parts(std::span<ExactPart> parts, const exact::Point& origin,
                        const RelativePose& pose, std::span<ContactPatch> patches) {
  std::uint32_t count = 0;
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (parts[p].kept != p) continue;
    const ExactInWorld sums = in_world(parts[p].sums, origin, pose);
    ContactPatch& patch = patches[parts[p].listed = count++];
    patch = {};
    patch.id = parts[p].id;
    patch.centroid = vector(sums.centroid);
    patch.volume = sums.volume;
    patch.force = -vector(sums.force);
    patch.torque = -vector(sums.torque);
  }
  for (ExactPart& part : parts) part.kept = parts[part.kept].listed;
  return count;
}

}  // namespace

Penetration exact_penetration(const PlacedAsset& a, const PlacedAsset& b,
                              const PenetrationSettings& settings, const RelativePose& pose,
                              Workspace& workspace) noexcept {
  if (a.asset.header().mesh == 0 || b.asset.header().mesh == 0) return missing_data<Penetration>();
  const MeshTree mesh_a = mesh_of(a), mesh_b = mesh_of(b);
  auto query = query_of<ExactQuery>(a, mesh_a, b, mesh_b, pose, workspace.impl()->exact);
  const ExactOverlap found = query.run(settings.max_visits, settings.pair_id);
  if (found.complete) return whole_answer(found, a, b, pose);
  return stopped(a, b,
                 lack_spheres(a, b) ? missing_data<Penetration>()
                                    : penetration(a, b, settings_of_spheres(settings), workspace));
}

OverlapOutline exact_patches(const PlacedAsset& a, const PlacedAsset& b,
                             const ContactSettings& settings, Workspace& workspace,
                             std::span<ContactPatch> patches, std::span<OutlineSegment> segments,
                             bool divides) noexcept {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<OverlapOutline>();
  if (a.asset.header().mesh == 0 || b.asset.header().mesh == 0)
    return missing_data<OverlapOutline>();
  OverlapOutline answer;
  const MeshTree mesh_a = mesh_of(a), mesh_b = mesh_of(b);
  ExactScratch& scratch = workspace.impl()->exact;
  auto query = query_of<ExactParts>(a, mesh_a, b, mesh_b, *pose, scratch);
  const ExactOverlap found = query.run(settings.max_visits, settings.pair_id);
  if (!found.complete || !query.holds_crossings()) {
    answer.contact = lack_spheres(a, b)
                         ? missing_data<ContactPatches>()
                         : find_patches(a, b, settings_of_spheres(settings), workspace, patches);
    answer.contact.penetration = stopped(a, b, answer.contact.penetration);
    return answer;
  }
  answer.contact.penetration = whole_answer(found, a, b, *pose);
  answer.segments = found.crossings;
  if (!patches.empty()) {
    std::span<ExactPart> parts(scratch.parts.get(), query.divide());
    const auto capacity = static_cast<std::uint32_t>(std::min<std::size_t>(patches.size(), ~0u));
    const auto keep = [&](bool octants) {
      return keep_largest(parts.data(), static_cast<std::uint32_t>(parts.size()), capacity,
                          octants);
    };
    const std::uint32_t kept = keep(false);
    if (divides && kept <= PartMemory::kMostSplit && capacity > 1) {
      join_parts(parts.data(), static_cast<std::uint32_t>(parts.size()));
      const bool by_b = volume_of(b) <= volume_of(a);
      const PlacedAsset& smaller = by_b ? b : a;
      const double radius = smaller.scale * smaller.asset.header().ball_radius / pose->unit_a;
      parts = {scratch.octants.get(), query.split(static_cast<std::uint32_t>(parts.size()), by_b,
                                                  kNearOctants * radius, capacity)};
      keep(true);
    } else if (divides) {
      for (ExactPart& part : parts) part.id *= 8;
    }
    join_parts(parts.data(), static_cast<std::uint32_t>(parts.size()));
    answer.contact.count = write_parts(parts, found.origin, *pose, patches);
    finish_patches(patches.first(answer.contact.count), b.pose,
                   exact_deepest(answer.contact.penetration.volume));
  }
  const auto to_world = [&](const exact::Point& p) {
    return pose->to_world(vector(found.origin) + vector(p));
  };
  for (std::uint32_t i = 0; i < std::min<std::size_t>(segments.size(), found.crossings); ++i) {
    exact::Point from, to;
    query.segment(i, from, to);
    const std::uint32_t patch = patches.empty() ? 0 : query.part_of_crossing(i);
    segments[i] = {to_world(from), to_world(to), patch};
  }
  return answer;
}

}  // namespace ist
