#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "cuda/base/atomics.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/mesh_gap_steps.h"
#include "cuda/query/separation_arrays.h"
#include "query/base/precision.h"

// The steps of a batch of separations, as batch_steps.h has penetrations.

namespace ist::gpu {

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
    // Cover gaps do not include yet what is too far apart for double (GapDescent).
    const double least = totals.cover - rounding - error;
    row.distance = unit * totals.gap;
    row.distance_min = unit * (least > 0 ? least : 0);
    row.distance_max = unit * (totals.gap + error);

    const NodeBall a = memory.tree[0].ball(kSphereLevel, totals.a);
    const NodeBall b = memory.tree[1].ball(kSphereLevel, totals.b);
    double moved[3];
    place.a_from_b.apply_fused(b.centre, moved);
    const Vec3 at_a = vec3(a.centre), at_b = vec3(moved), way = at_b - at_a;
    const Vec3 axis = way / norm(way);
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

/// Loads pair i into memory.
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
