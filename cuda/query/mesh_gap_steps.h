#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/base/atomics.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/gap_descent.h"
#include "cuda/query/mesh_gap_search.h"
#include "cuda/query/separation_arrays.h"
#include "query/base/precision.h"
#include "query/exact/inside_search.h"

// The steps of distances of a batch's meshes, for the threads and warps of kernels and for tests on
// the host. Answers are those of SurfaceGap (query/separation.cpp).

namespace ist::gpu {

/// The placed solid that is A or B in the query.
IST_HD inline const GpuPlacedSolids& side_of(const SolidPairs& batch, const MeshGapQuery& query,
                                             int side) {
  return (side == 0) == (query.swapped == 0) ? batch.pairs.a : batch.pairs.b;
}
IST_HD inline const SolidRef& solid_of(const SolidPairs& batch, const MeshGapQuery& query,
                                       int side) {
  return solid_of(batch, side_of(batch, query, side), query.pair);
}

/// The answer for solids that are certainly farther apart than the caller's limit (farther_than()).
IST_HD inline SeparationRow farther_row(double most) {
  SeparationRow row = no_row<SeparationRow>(QueryStatus::invalid_input);
  row.distance = row.distance_min = most;
  row.distance_max = HUGE_VAL;
  row.status = QueryStatus::ok;
  return row;
}

/// The counters of the n-th round.
IST_HD inline MeshGapRound& round_of(const MeshGapArrays& meshes, std::uint32_t n) {
  return meshes.rounds[n % 2];
}

/// Places the k-th pair of a round, which is pair i of the batch. One thread per pair.
IST_HD inline void place_mesh_gap(const SeparationArrays& batch, MeshGapRound& round,
                                  std::uint32_t k, std::uint32_t i) {
  MeshGapQuery& query = batch.meshes.queries[k];
  const SolidPairs& pairs = batch.pairs;
  PairPlace place;
  query.pair = i;
  query.swapped = 0;
  place_exactly(pairs, i, place);
  if (place.a_from_b.scale > kLargestGapScale) {
    query.swapped = 1;
    place_exactly(pairs, side_of(pairs, query, 0), side_of(pairs, query, 1), i, place);
  }
  const GpuPlacedSolids &placed_a = side_of(pairs, query, 0), &placed_b = side_of(pairs, query, 1);
  const SolidRef &solid_a = solid_of(pairs, placed_a, i), &solid_b = solid_of(pairs, placed_b, i);
  const MeshTree &a = solid_a.mesh, &b = solid_b.mesh;
  const auto offset = [&](const SolidRef& solid, const GpuPlacedSolids& side) {
    return scale_of(side, i) * norm(solid.frame.centre);
  };
  const double moved =
      moved_by_poses(pose_of(placed_a, i).t, offset(solid_a, placed_a), pose_of(placed_b, i).t,
                     offset(solid_b, placed_b), b.extent(), place);
  const double scale = place.a_from_b.scale;
  query.place = place;
  query.error = gap_error(a, b, place, moved);
  query.simplified = a.header->error + scale * b.header->error;
  query.reach = reach_of(a, b, place.a_from_b);
  query.single = floats_tell(a, b, scale, query.reach) ? 1 : 0;
  query.most = batch.max_distance > 0 ? batch.max_distance / place.unit_a + query.error : HUGE_VAL;
  query.likely = HUGE_VAL;
  query.toward = {0, 0, 0};
  query.visits = query.tests = query.overlap = query.stopped = query.waiting = 0;
  query.left = HUGE_VAL;
  query.best = {};
  query.best.rounding = gap_rounding(query.reach);
  if (query.single == 0) batch.meshes.queries[atomic_add(&round.in_double, 1)].in_double = k;
}

/// Inner spheres that intersect prove an overlap. Others bound the distance and give a direction.
template <class Team>
IST_HD void glance_at_spheres(const Team& team, const SeparationArrays& batch, std::uint32_t k,
                              GapMemory<float>& memory) {
  MeshGapQuery& query = batch.meshes.queries[k];
  const SolidRef &a = solid_of(batch.pairs, query, 0), &b = solid_of(batch.pairs, query, 1);
  if (query.single == 0 || !a.has_spheres() || !b.has_spheres()) return;
  team.sync();
  copy_words(team, query.place, memory.place);
  for (int side = 0; side < 2; ++side) {
    const SolidRef& solid = side == 0 ? a : b;
    copy_words(team, solid.tree[static_cast<int>(Measure::inner)], memory.tree[side]);
    copy_words(team, solid.cover, memory.cover[side]);
  }
  team.sync();
  const Similarity& map = memory.place.a_from_b;
  const double length = span(memory.root(0), memory.root(1), map);
  if (precision_for_gap(memory.root(0), memory.root(1), map) != Precision::float32) return;
  const double off = distance_error(Precision::float64, length) + memory.place.rounding_of_world();
  GapDescent<Team, float> descent(team, memory);
  descent.start(false);
  descent.run(0, batch.max_visits < kGlance ? batch.max_visits : kGlance);
  descent.finish(0);
  if (team.lane() != 0) return;
  const GapTotals& found = memory.best;
  query.visits = found.visits;
  query.tests = found.spheres;
  query.overlap = found.gap < -off ? 2 : 0;
  query.likely = (found.gap > 0 ? found.gap : 0) + query.error + off;
  double moved[3];
  map.apply_fused(memory.tree[1].ball(kSphereLevel, found.b).centre, moved);
  const Vec3 way = vec3(moved) - vec3(memory.tree[0].ball(kSphereLevel, found.a).centre);
  if (const double far = norm(way); far > 0) query.toward = way / far;
}

/// Loads a pair into a team's memory.
template <class Team>
IST_HD void load_mesh_gap(const Team& team, const SeparationArrays& batch,
                          const MeshGapQuery& query, MeshGapPair& memory) {
  team.sync();
  copy_words(team, query.place.a_from_b, memory.map[0]);
  copy_words(team, query.place.b_from_a, memory.map[1]);
  copy_words(team, query.best, memory.best);
  for (int side = 0; side < 2; ++side)
    copy_words(team, solid_of(batch.pairs, query, side).mesh, memory.mesh[side]);
  if (team.lane() == 0) {
    memory.reach = query.reach;
    memory.crosses = 0;
    memory.level = {0, 0, 0};
  }
  team.sync();
}

/// Searches both meshes of the k-th pair of a round.
template <class Real, class Team>
IST_HD void search_mesh_gap(const Team& team, const SeparationArrays& batch, std::uint32_t k,
                            MeshGapMemory<Real>& memory) {
  MeshGapQuery& query = batch.meshes.queries[k];
  if (query.overlap != 0 || (query.single != 0) != (sizeof(Real) == 4)) return;
  load_mesh_gap(team, batch, query, memory);
  if (team.lane() == 0)
    for (int side = 0; side < 2; ++side)
      memory.in_floats[side] = solid_of(batch.pairs, query, side).in_floats;
  team.sync();
  const double slack = gap_slack(query.reach);
  const double most = (query.most + slack) * (sizeof(Real) == 4 ? 1 : 1 + 2 * kGapsAlike);
  const std::uint32_t visits = batch.max_visits == ~0u ? ~0u : batch.max_visits - query.visits;
  MeshGapSearch<Team, Real> search(team, memory, query.toward);
  if (batch.max_visits != ~0u) search.begin();
  // If nothing is as near as is likely, one solid contains the other, or rounding decides.
  double limit = std::fmin(most, query.likely + slack);
  IST_ROLLED
  for (;;) {
    search.run(limit, visits);
    const bool none = memory.best.pair == NearestTriangles::kNone && search.queued() == 0;
    if (!none || memory.crosses != 0 || search.stopped() || !(limit < most)) break;
    limit = most;
  }
  const double left = search.stopped() ? search.left() : HUGE_VAL;
  const std::uint32_t waiting = search.queued();
  team.sync();
  copy_words(team, memory.best, query.best);
  for (std::uint32_t n = static_cast<std::uint32_t>(team.lane()); n < waiting;
       n += static_cast<std::uint32_t>(Team::kWidth))
    for (int side = 0; side < 2; ++side) query.triangles[n][side] = memory.queue[n][side];
  if (team.lane() != 0) return;
  query.waiting = waiting;
  query.visits += search.visits();
  query.tests += search.tests() + waiting;
  query.overlap = memory.crosses;
  query.stopped = search.stopped() ? 1 : 0;
  query.left = left;
}

/// Measures the queued pairs that the search of a round's k-th pair has left.
template <class Team>
IST_HD void measure_mesh_gap(const Team& team, const SeparationArrays& batch, std::uint32_t k,
                             MeshGapPair& memory) {
  MeshGapQuery& query = batch.meshes.queries[k];
  const std::uint32_t waiting = query.waiting;
  if (waiting == 0) return;
  load_mesh_gap(team, batch, query, memory);
  constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  for (std::uint32_t first = 0; first < waiting; first += kBatch) {
    const std::uint32_t count = waiting - first < kBatch ? waiting - first : kBatch;
    for (std::uint32_t n = static_cast<std::uint32_t>(team.lane()); n < count; n += kBatch)
      for (int side = 0; side < 2; ++side) memory.queue[n][side] = query.triangles[first + n][side];
    team.sync();
    measure_triangles(team, memory, 0, count);
  }
  copy_words(team, memory.best, query.best);
  if (team.lane() == 0 && memory.crosses != 0) query.overlap = 1;
}

/// True if a solid contains a shell of the other, B or A. Called by the whole team.
template <class Team>
IST_HD bool holds_shell(const Team& team, const SolidPairs& batch, const MeshGapQuery& query,
                        bool b_in_a, InsideStack& stack) {
  const MeshTree& other = solid_of(batch, query, b_in_a ? 1 : 0).mesh;
  const MeshTree& mesh = solid_of(batch, query, b_in_a ? 0 : 1).mesh;
  const Similarity& a_from_b = query.place.a_from_b;
  const MeshOfPair solid =
      b_in_a ? MeshOfPair{mesh} : MeshOfPair{mesh, &a_from_b, &query.place.b_from_a};
  bool unsure = false;
  for (std::uint32_t s = 0; s < other.header->shell_count; ++s) {
    const exact::Point x = other.vertex(other.blocks[other.shells[s].block].vertex[0]);
    if (is_inside<true>(team, solid, b_in_a ? map_point(a_from_b, x) : x, {0, 0, 0}, stack, unsure))
      return true;
  }
  return false;
}

/// Answers the k-th pair of a round.
template <class Team>
IST_HD void finish_mesh_gap(const Team& team, const SeparationArrays& batch, std::uint32_t k,
                            InsideStack& stack) {
  const MeshGapQuery& query = batch.meshes.queries[k];
  const NearestTriangles& best = query.best;
  const bool overlap = query.overlap != 0 || holds_shell(team, batch.pairs, query, false, stack) ||
                       holds_shell(team, batch.pairs, query, true, stack);
  if (team.lane() != 0) return;
  const PairPlace& place = query.place;
  const double unit = place.unit_a, slack = gap_slack(query.reach);
  const double most = (query.most + slack) * (query.single != 0 ? 1 : 1 + 2 * kGapsAlike);
  const double distance = best.least > 0 ? std::sqrt(best.squared) : 0;
  SeparationRow row = {};
  if (!overlap && query.stopped == 0 && best.least > most * most) {
    row = farther_row(batch.max_distance);
  } else if (overlap || distance == 0) {
    // Spheres have no error of their own.
    row.distance_max = query.overlap == 2 ? 0 : unit * query.simplified;
  } else {
    // From the pair that answers, since which of several equal pairs is the least depends on the
    // search.
    const double nearest = std::fmin(distance - best.rounding, std::sqrt(query.left));
    const double least = (1 - 1e-12) * nearest - slack;
    row.distance = unit * distance;
    row.distance_min = unit * std::fmax(0.0, std::fmax(0.0, least) - query.error);
    row.distance_max = unit * (distance * (1 + 1e-15) + query.error);
    const Vec3 at_a = best.on_a, at_b = best.on_a + best.between;
    row.point_a = place.to_world(query.swapped == 0 ? at_a : at_b);
    row.point_b = place.to_world(query.swapped == 0 ? at_b : at_a);
    const double way = query.swapped == 0 ? norm(best.between) : -norm(best.between);
    row.normal = turned(place.rotation_a, best.between / way);
  }
  if (query.stopped != 0) row.status = QueryStatus::budget_exhausted;
  row.node_visits = query.visits;
  row.sphere_pairs = query.tests;
  write_row(batch.answers, query.pair, row);
}

}  // namespace ist::gpu
