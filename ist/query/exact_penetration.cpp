#include "query/exact_penetration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "query/base/no_answer.h"
#include "query/base/solid_bounds.h"
#include "query/contact/write_patches.h"
#include "query/descent/workspace.h"
#include "query/exact/exact_parts.h"
#include "query/exact/kept_mesh.h"

namespace ist {
namespace {

template <class Query>
Query query_of(const PlacedTree& a, const MeshTree& mesh_a, const PlacedTree& b,
               const MeshTree& mesh_b, const RelativePose& pose, ExactScratch& scratch) {
  const double moved_b =
      moved_by_poses(a, b, mesh_b, pose) + pose.a_from_b.scale * moved_in_mesh(mesh_b);
  return {mesh_a, moved_in_mesh(mesh_a), mesh_b, moved_b, pose.a_from_b, pose.b_from_a, scratch};
}

Eigen::Vector3d vector(const exact::Point& p) { return {p.x, p.y, p.z}; }

}  // namespace

namespace {

/// Sums of an overlap or a part of it in world units, all but the volume's bounds.
struct WorldSums {
  double volume;
  Eigen::Vector3d centroid, force, torque;

  WorldSums(const ExactSums& sums, const exact::Point& origin, const RelativePose& pose) {
    const double u = pose.unit_a, found = sums.volume();
    volume = found * (u * u * u);
    force = pose.rotation_a * vector(sums.force) * (u * u);
    centroid.setZero();
    if (found != 0) centroid = pose.to_world(vector(origin) + vector(sums.moment) / (24 * found));
    // The sums' origin from B's.
    const Eigen::Vector3d shift(pose.a_from_b.t[0], pose.a_from_b.t[1], pose.a_from_b.t[2]);
    const Eigen::Vector3d arm =
        pose.rotation_a * ((vector(origin) - shift) * u) + pose.unit_offset_b;
    torque = pose.rotation_a * vector(sums.torque) * (u * u * u) + arm.cross(force);
  }
};

Penetration whole_answer(const ExactOverlap& found, const RelativePose& pose) {
  const double u = pose.unit_a;
  const WorldSums sums(found.sums, found.origin, pose);
  Penetration answer;
  answer.volume = std::max(0.0, sums.volume);
  const double error = found.error * (u * u * u) + (answer.volume - sums.volume);
  answer.volume_min = std::max(0.0, answer.volume - error);
  answer.volume_max = answer.volume + error;
  if (answer.volume > 0) answer.centroid = sums.centroid;
  answer.translation_gradient = sums.force;
  answer.rotation_gradient = sums.torque;
  answer.node_visits = found.visits;
  answer.sphere_pairs = found.crossings;
  return answer;
}

/// What spheres say, where a limit stops the exact query.
template <class Answer, class Spheres>
Answer stopped(const PlacedTree& a, const PlacedTree& b, Answer answer, const Spheres& by_spheres,
               Penetration& (*whole)(Answer&)) {
  if (a.tree.sphere_count() > 0 && b.tree.sphere_count() > 0) answer = by_spheres();
  bound_by_solids(a, b, whole(answer));
  whole(answer).status = QueryStatus::budget_exhausted;
  return answer;
}

/// As many parts as there is room for, the largest; each other one joins the nearest of these.
std::uint32_t keep_largest(std::span<ExactPart> parts, std::size_t room) {
  std::uint32_t kept = 0;
  for (const ExactPart& part : parts) kept += &parts[part.kept] == &part ? 1 : 0;
  const auto middle = [](const ExactPart& part) -> Eigen::Vector3d {
    return vector(part.sums.moment) / (24 * part.sums.volume());
  };
  while (kept > room) {
    std::uint32_t least = ~0u, nearest = ~0u;
    for (std::uint32_t p = 0; p < parts.size(); ++p)
      if (parts[p].kept == p &&
          (least == ~0u || parts[p].sums.volume() < parts[least].sums.volume()))
        least = p;
    for (std::uint32_t p = 0; p < parts.size(); ++p)
      if (parts[p].kept == p && p != least &&
          (nearest == ~0u || (middle(parts[p]) - middle(parts[least])).squaredNorm() <
                                 (middle(parts[nearest]) - middle(parts[least])).squaredNorm()))
        nearest = p;
    parts[least].kept = nearest;
    --kept;
  }
  for (ExactPart& part : parts)
    while (parts[part.kept].kept != part.kept) part.kept = parts[part.kept].kept;
  return kept;
}

/// Writes the kept parts in their order, what joined them added; `kept` becomes the patch.
std::size_t write_parts(std::span<ExactPart> parts, const exact::Point& origin,
                        const RelativePose& pose, std::span<ContactPatch> patches) {
  for (const ExactPart& part : parts) {
    ExactPart& into = parts[part.kept];
    if (&into == &part) continue;
    into.sums.six_volumes.add(part.sums.six_volumes.value());
    into.sums.moment = into.sums.moment + part.sums.moment;
    into.sums.force = into.sums.force + part.sums.force;
    into.sums.torque = into.sums.torque + part.sums.torque;
  }
  std::uint32_t count = 0;
  std::uint32_t place[ExactScratch::kMostParts];
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (parts[p].kept != p) continue;
    const WorldSums sums(parts[p].sums, origin, pose);
    ContactPatch& patch = patches[place[p] = count++];
    patch = {};
    patch.id = parts[p].id;
    patch.centroid = sums.centroid;
    patch.volume = sums.volume;
    patch.force = -sums.force;
    patch.torque = -sums.torque;
  }
  for (ExactPart& part : parts) part.kept = place[part.kept];
  return count;
}

}  // namespace

double exact_deepest(double volume) noexcept {
  // The cube root from square roots alone: the C library's differs between processors. Each step
  // leaves a quarter of the error of the logarithm.
  double y = std::sqrt(volume);
  for (int k = 0; k < 30; ++k) y = std::sqrt(std::sqrt(volume * y));
  return y;
}

Penetration exact_penetration(const PlacedTree& a, const PlacedTree& b,
                              const PenetrationSettings& settings, const RelativePose& pose,
                              Workspace& workspace) noexcept {
  if (a.tree.header().mesh == 0 || b.tree.header().mesh == 0) return not_held<Penetration>();
  const MeshTree mesh_a = mesh_of(a), mesh_b = mesh_of(b);
  auto query = query_of<ExactQuery>(a, mesh_a, b, mesh_b, pose, workspace.impl()->exact);
  const ExactOverlap found = query.run(settings.max_visits);
  if (found.complete) return whole_answer(found, pose);
  const auto by_spheres = [&] {
    PenetrationSettings others = settings;
    others.measure = Measure::matched;
    others.relative_error = 0;
    return penetration(a, b, others, workspace);
  };
  return stopped<Penetration>(a, b, not_held<Penetration>(), by_spheres,
                              [](Penetration& answer) -> Penetration& { return answer; });
}

OverlapOutline exact_patches(const PlacedTree& a, const PlacedTree& b,
                             const ContactSettings& settings, Workspace& workspace,
                             std::span<ContactPatch> patches,
                             std::span<OutlineSegment> segments) noexcept {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<OverlapOutline>();
  if (a.tree.header().mesh == 0 || b.tree.header().mesh == 0) return not_held<OverlapOutline>();
  OverlapOutline answer;
  const MeshTree mesh_a = mesh_of(a), mesh_b = mesh_of(b);
  ExactScratch& scratch = workspace.impl()->exact;
  auto query = query_of<ExactParts>(a, mesh_a, b, mesh_b, *pose, scratch);
  const ExactOverlap found = query.run(settings.max_visits);
  if (!found.complete) {
    const auto by_spheres = [&] {
      ContactSettings others = settings;
      others.measure = Measure::matched;
      others.relative_error = 0;
      return contact_patches(a, b, others, workspace, patches);
    };
    answer.contact = stopped<ContactPatches>(
        a, b, not_held<ContactPatches>(), by_spheres,
        [](ContactPatches& stopped) -> Penetration& { return stopped.penetration; });
    return answer;
  }
  answer.contact.penetration = whole_answer(found, *pose);
  answer.segments = found.crossings;
  if (!patches.empty()) {
    const std::span<ExactPart> parts(scratch.parts.get(), query.divide());
    keep_largest(parts, patches.size());
    answer.contact.count = write_parts(parts, found.origin, *pose, patches);
    finish_patches(patches.first(answer.contact.count),
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
