#pragma once

#include <cmath>
#include <cstdint>

#include "base/team.h"
#include "cuda/query/answers.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/exact_pair.h"
#include "cuda/query/exact_search.h"
#include "query/exact/no_volume.h"
#include "query/exact/overlap_formulas.h"

// How two solids without common volume touch: find_contact() of the CPU.

namespace ist::gpu {

/// Adds the common area of a lane's triangles, which are in one plane and face each other.
IST_HD_COLD void add_common_area(const CornerView& view, ContactSums& sums) {
  const exact::Point a[3] = {view.corner(0, 0), view.corner(0, 1), view.corner(0, 2)},
                     b[3] = {view.corner(1, 0), view.corner(1, 1), view.corner(1, 2)};
  const exact::Point normal = cross(a[1] - a[0], a[2] - a[0]);
  const exact::CommonArea common = exact::common_area(a, b, normal);
  const double area = common.over_normal * norm(normal);
  const int lane = view.lane;
  sums.of[ContactSums::kArea][lane] += area;
  const exact::Point along = common.over_normal * normal, moment = area * (a[0] + common.centre);
  for (int k = 0; k < 3; ++k) {
    sums.of[ContactSums::kNormal + k][lane] += along[k];
    sums.of[ContactSums::kMoment + k][lane] += moment[k];
  }
}

/// True if a lane's triangles, which do not cross, are nearer than `distance`.
IST_HD_COLD bool come_within(double distance, const CornerView& view) {
  exact::Flat flat[2];
  for (int s = 0; s < 2; ++s) {
    for (int k = 0; k < 3; ++k) flat[s].corner[k] = view.corner(s, k);
    exact::flatten(flat[s]);
  }
  bool unclear = false;
  return exact::nearest_points(flat[0], flat[1], 0, unclear).squared < distance * distance;
}

/// True if a lane's triangles are within `distance` of one plane and face each other. Either
/// triangle's plane may be used, since that of a sliver is arbitrary.
IST_HD inline bool flush(double distance, const CornerView& view) {
  exact::Point normal[2];
  bool level = false;
  for (int s = 0; s < 2; ++s) {
    const exact::Point o = view.corner(s, 0);
    const exact::FilteredPlane plane(view.corner(s, 1) - o, view.corner(s, 2) - o, {0, 0, 0});
    normal[s] = plane.normal;
    const double far = distance * norm(plane.normal);
    bool in_plane = true;
    for (int k = 0; k < 3; ++k) {
      const exact::Determinant height = plane.height(view.corner(1 - s, k) - o);
      in_plane = in_plane && std::abs(height.value) <= far + height.error;
    }
    level = level || in_plane;
  }
  return level && dot(normal[0], normal[1]) < 0;
}

/// Tests the next `count` queued pairs of triangles for contact. False if two cross wherever points
/// move within the tolerance: then the solids overlap, however little.
template <class Team>
IST_HD bool touch_triangles(const Team& team, const ExactPair& of, ExactContactMemory& memory,
                            std::uint32_t first, std::uint32_t count, bool& touches) {
  const auto lane = static_cast<std::uint32_t>(team.lane());
  const bool has = lane < count;
  const std::uint32_t(&slot)[2] = memory.queue[(first + (has ? lane : 0)) % kExactWaiting];
  const CornerView view = {memory.contact.corners, team.lane()};
  for (int side = 0; side < 2; ++side)
    for (int k = 0; k < 3; ++k) view.set(side, k, of.corner(side, slot[side], k));
  team.sync();  // all have read the queue
  PiercingEdge end[2];
  const PairSays says =
      has ? cross_pair<Signs::settled>(view, of.aside, end, of.reach[0]) : PairSays::apart;
  if (team.any(says == PairSays::crosses)) return false;
  if (has && flush(flush_distance(of.touch), view)) add_common_area(view, memory.contact);
  if (!touches) touches = team.any(says != PairSays::apart && come_within(of.touch, view));
  return true;
}

/// Decides if the solids of pair i, whose volume may be 0, touch, and rewrites the answer if so;
/// lane 0 returns true then.
template <class Team>
IST_HD bool find_contact(const Team& team, const SolidPairs& batch, std::uint32_t i,
                         const ExactPair& pair, ExactContactMemory& memory, const ExactLeft& left,
                         std::uint64_t* waiting, std::uint32_t most_waiting) {
  team.sync();
  for (auto& sums : memory.contact.of)
    for (int k = team.lane(); k < 32; k += Team::kWidth) sums[k] = 0;
  ExactSearch<Team> search(team, pair, memory, waiting, most_waiting, {});
  bool touches = false, crosses = false;
  const bool all = search.run([&](std::uint32_t first, std::uint32_t count) {
    crosses = !touch_triangles(team, pair, memory, first, count, touches);
    return !crosses;
  });
  if (crosses)
    for (int k = 0; k < ContactSums::kCount; ++k) memory.contact.of[k][team.lane()] = 0;
  double total[ContactSums::kCount];
  for (int k = 0; k < ContactSums::kCount; ++k)
    total[k] = team.sum(memory.contact.of[k][team.lane()]);
  const double area = total[ContactSums::kArea];
  const double smaller =
      std::fmin(pair.mesh[0].extent(), pair.place.a_from_b.scale * pair.mesh[1].extent());
  const bool is_none =
      crosses ? !(left.volume > 0)
              : all && touches && has_no_volume(left.volume, left.push, area, pair.touch, smaller);
  if (team.lane() != 0 || !is_none) return false;
  const auto vector = [&](int k) { return Vec3{total[k], total[k + 1], total[k + 2]}; };
  const PairPlace& place = pair.place;
  ContactRow row = {};
  row.touching = true;
  row.volume_max = std::fmin(smaller_volume(batch, i), left.error * place.unit3());
  row.contact_area = area * (place.unit_a * place.unit_a);
  if (area > 0) row.centroid = place.to_world(vector(ContactSums::kMoment) / area);
  // Normals that cancel leave only the rounding of areas.
  const Vec3 normal = vector(ContactSums::kNormal);
  if (const double length = norm(normal); length > 1e-9 * area)
    row.contact_normal = turned(place.rotation_a, normal / length);
  write_row(batch.answers, i, row);
  return true;
}

}  // namespace ist::gpu
