#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"
#include "cuda/base/atomics.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/gap_descent.h"
#include "cuda/query/mesh_gap_search.h"
#include "cuda/query/separation_arrays.h"
#include "query/base/precision.h"
#include "query/exact/inside_search.h"

// The steps of a batch of separations; batch_steps.h has those of penetrations.

namespace ist::gpu {

// The steps of distances of a batch's meshes, for the threads and warps of kernels and for tests on
// the host. Answers are those of SurfaceGap (query/separation.cpp).

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
  const Vec3 toward = vec3(moved) - vec3(memory.tree[0].ball(kSphereLevel, found.a).centre);
  if (const double far = norm(toward); far > 0) query.toward = toward / far;
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
  // If nothing is as near as `likely`, one solid contains the other, or rounding decides.
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

/// True if a solid contains a shell of the other. Called by the whole team.
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
    // Starts from the pair that answers, since which of several equal pairs is the least depends on
    // the search.
    const double nearest = std::fmin(distance - best.rounding, std::sqrt(query.left));
    const double least = (1 - 1e-12) * nearest - slack;
    row.distance = unit * distance;
    row.distance_min = unit * std::fmax(0.0, std::fmax(0.0, least) - query.error);
    row.distance_max = unit * (distance * (1 + 1e-15) + query.error);
    const Vec3 at_a = best.on_a, at_b = best.on_a + best.between;
    row.point_a = place.to_world(query.swapped == 0 ? at_a : at_b);
    row.point_b = place.to_world(query.swapped == 0 ? at_b : at_a);
    const double length = query.swapped == 0 ? norm(best.between) : -norm(best.between);
    row.normal = turned(place.rotation_a, best.between / length);
  }
  if (query.stopped != 0) row.status = QueryStatus::budget_exhausted;
  row.node_visits = query.visits;
  row.sphere_pairs = query.tests;
  write_row(batch.answers, query.pair, row);
}

/// The number of node pairs that one team opens before it divides the rest, and the weight of a
/// task: leaves count 1, pairs above them more.
constexpr std::uint32_t kGapsAlone = 160;
constexpr std::uint32_t kGapTaskWeight = 16;

/// Writes an answer in world units, as separation(). Called by one lane.
template <class Real>
IST_HD void finish_separation(const SeparationArrays& batch, std::uint32_t i,
                              const GapMemory<Real>& memory, const GapTotals& totals) {
  SeparationRow row = {};
  row.node_visits = totals.visits;
  row.sphere_pairs = totals.spheres;
  if (!totals.overlap()) {
    if (totals.out_of_time != 0) row.status = QueryStatus::budget_exhausted;
    const PairPlace& place = memory.place;
    const double unit = place.unit_a;
    const double rounding =
        ist::distance_error<double>(span(memory.root(0), memory.root(1), place.a_from_b));
    const double error = rounding + place.rounding_of_world();
    // Cover gaps do not yet include pairs that are too far apart for double (GapDescent).
    const double least = totals.cover - rounding - error;
    row.distance = unit * totals.gap;
    row.distance_min = unit * (least > 0 ? least : 0);
    row.distance_max = unit * (totals.gap + error);

    const NodeBall a = memory.tree[0].ball(kSphereLevel, totals.a);
    const NodeBall b = memory.tree[1].ball(kSphereLevel, totals.b);
    double moved[3];
    place.a_from_b.apply_fused(b.centre, moved);
    const Vec3 at_a = vec3(a.centre), at_b = vec3(moved), between = at_b - at_a;
    const Vec3 axis = between / norm(between);
    row.point_a = place.to_world(at_a + a.r * axis);
    row.point_b = place.to_world(at_b - place.a_from_b.scale * b.r * axis);
    row.normal = turned(place.rotation_a, axis);
    if (batch.max_distance > 0 && row.distance_min > batch.max_distance)
      row = farther_row(batch.max_distance);
  }
  write_row(batch.answers, i, row);
}

/// The list of pair i: 0 spheres in float, 1 in double, 2 meshes; −1 if it is answered. One thread
/// per pair.
IST_HD inline int sift_separation(const SeparationArrays& batch, std::uint32_t i) {
  PairPlace place;
  if (kind_of(batch.pairs, i) == PairKind::trees &&
      solid_of(batch.pairs, batch.pairs.pairs.a, i).mesh.header != nullptr &&
      solid_of(batch.pairs, batch.pairs.pairs.b, i).mesh.header != nullptr) {
    if (place_exactly(batch.pairs, i, place)) return 2;
    write_row(batch.answers, i, no_row<SeparationRow>(QueryStatus::invalid_input));
    return -1;
  }
  const QueryStatus placed = place_trees(batch.pairs, i, place);
  if (placed != QueryStatus::ok) {
    write_row(batch.answers, i, no_row<SeparationRow>(placed));
    return -1;
  }
  const SolidRef& a = solid_of(batch.pairs, batch.pairs.pairs.a, i);
  const SolidRef& b = solid_of(batch.pairs, batch.pairs.pairs.b, i);
  const TreeRef& tree_a = a.tree[static_cast<int>(Measure::inner)];
  const TreeRef& tree_b = b.tree[static_cast<int>(Measure::inner)];
  const Precision precision =
      precision_for_gap(RootBall::of(tree_a.root, a.cover.root),
                        RootBall::of(tree_b.root, b.cover.root), place.a_from_b);
  return precision == Precision::float32 ? 0 : 1;
}

template <class Team, class Real>
IST_HD void load_separation(const Team& team, const SeparationArrays& batch, std::uint32_t i,
                            GapMemory<Real>& memory) {
  if (team.lane() == 0) place_pair(batch.pairs, i, memory.place);
  load_trees(team, batch.pairs, i, memory);
  if (team.lane() == 0) {
    memory.cover[0] = solid_of(batch.pairs, batch.pairs.pairs.a, i).cover;
    memory.cover[1] = solid_of(batch.pairs, batch.pairs.pairs.b, i).cover;
  }
  team.sync();
}

/// The lowest entry of the task that begins with the topmost of `waiting` entries.
template <class Real>
IST_HD int gap_task_floor(const GapMemory<Real>& memory, int waiting) {
  std::uint32_t weight = 0;
  while (waiting > 0 && weight < kGapTaskWeight) {
    const std::uint32_t a = memory.stack_a[waiting - 1], b = memory.stack_b[waiting - 1];
    const std::uint32_t levels = (a >> (kGapNodeBits + 1)) + (b >> (kGapNodeBits + 1));
    weight += levels >= 2 ? kGapTaskWeight : 1u << 2 * levels;
    --waiting;
  }
  return waiting;
}

/// Leaves the pending entries to other teams; false if there is no memory. Called by the whole
/// team.
template <class Team, class Real>
IST_HD bool split_separation(const Team& team, const SeparationArrays& batch, std::uint32_t i,
                             const GapMemory<Real>& memory, int waiting) {
  const SplitSlots work =
      reserve_split(team, batch.pairs, batch.counters[sizeof(Real) == 4 ? 0 : 1], i, waiting,
                    [&](int top) { return gap_task_floor(memory, top); });
  if (!work.fits) return false;
  if (team.lane() == 0) batch.totals[work.split] = memory.before;
  for (int k = team.lane(); k < waiting; k += Team::kWidth) {
    const std::uint32_t at = work.first_entry + static_cast<std::uint32_t>(k);
    batch.entries.a[at] = memory.stack_a[k];
    batch.entries.b[at] = memory.stack_b[k];
    batch.entries.gap[at] = static_cast<double>(memory.stack_gap[k]);
    batch.entries.cover[at] = static_cast<double>(memory.stack_cover[k]);
  }
  return true;
}

/// The visits of each of `tasks` after the first ones of a pair.
IST_HD inline std::uint32_t task_visits(std::uint32_t max_visits, std::uint32_t tasks) {
  return max_visits == ~0u ? max_visits : (max_visits - kGapsAlone) / tasks;
}

/// Searches pair i, or the part of it that one team does alone.
template <class Team, class Real>
IST_HD void separate_pair(const Team& team, const SeparationArrays& batch, std::uint32_t i,
                          GapMemory<Real>& memory) {
  load_separation(team, batch, i, memory);
  GapDescent<Team, Real> descent(team, memory);
  descent.start();
  const bool may_split = batch.max_visits > kGapsAlone;
  std::uint32_t most = may_split ? kGapsAlone : batch.max_visits;
  int floor = 0;
  for (bool first = true;; first = false) {
    descent.run(floor, most);
    const bool splits = first && may_split && descent.waiting() > 0 && !descent.overlap();
    descent.finish(splits ? descent.waiting() : floor);
    if (team.lane() == 0) {
      if (first) {
        memory.sum = memory.before = memory.best;
      } else {
        memory.sum.add(memory.best);
      }
    }
    team.sync();
    if (splits) {
      if (split_separation(team, batch, i, memory, descent.waiting())) return;
      std::uint32_t tasks = 0;
      for (int top = descent.waiting(); top > 0; ++tasks) top = gap_task_floor(memory, top);
      most = task_visits(batch.max_visits, tasks);
    }
    if (descent.waiting() == 0) break;
    // Tasks run one by one, each as if other teams did the rest.
    floor = gap_task_floor(memory, descent.waiting());
    descent.restart(memory.before);
  }
  if (team.lane() == 0) finish_separation(batch, i, memory, memory.sum);
  team.sync();
}

/// Searches a task. The team that finishes a pair's last task writes the answer.
template <class Team, class Real>
IST_HD void separate_task(const Team& team, const SeparationArrays& batch, std::uint32_t index,
                          GapMemory<Real>& memory) {
  const PairTask task = batch.pairs.tasks[index];
  if (task.count == 0) return;
  SplitPair& split = batch.pairs.splits[task.split];
  load_separation(team, batch, split.pair, memory);
  GapDescent<Team, Real> descent(team, memory);
  descent.restart(batch.totals[task.split]);
  descent.resume(batch.entries, task.first, static_cast<int>(task.count));
  descent.run(0, task_visits(batch.max_visits, split.tasks));
  descent.finish(0);
  if (team.lane() == 0) {
    GapTotals* const of_tasks = batch.totals + batch.pairs.split_capacity;
    of_tasks[index] = memory.best;
    publish();
    if (atomic_add(&split.left, ~0u) == 1) {
      publish();
      GapTotals sum = batch.totals[task.split];
      for (std::uint32_t k = 0; k < split.tasks; ++k) sum.add(of_tasks[split.first_task + k]);
      finish_separation(batch, split.pair, memory, sum);
    }
  }
  team.sync();
}

}  // namespace ist::gpu
