#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/separation_arrays.h"
#include "numerics/host_device.h"
#include "query/asset/shared_constants.h"

// A batch of separations, step by step, as batch_steps.h has penetrations.

namespace ist::gpu {

/// Node pairs that one team opens before what is left is divided, and the weight of a task: leaves
/// count 1, pairs above them more.
constexpr std::uint32_t kGapsAlone = 160;
constexpr std::uint32_t kGapTaskWeight = 16;

/// [u] The axis between the nearest spheres, world; nothing where spheres overlap.
struct GapWitness {
  double point_a[3], point_b[3], normal[3];
};

IST_HD inline void write_separation(const GpuSeparations& to, std::uint32_t i, QueryStatus status,
                                    const double (&distance)[3], const GapWitness& witness,
                                    std::uint32_t visits, std::uint32_t spheres) {
  if (to.distance != nullptr) to.distance[i] = distance[0];
  if (to.distance_min != nullptr) to.distance_min[i] = distance[1];
  if (to.distance_max != nullptr) to.distance_max[i] = distance[2];
  write3(to.point_a, i, witness.point_a[0], witness.point_a[1], witness.point_a[2]);
  write3(to.point_b, i, witness.point_b[0], witness.point_b[1], witness.point_b[2]);
  write3(to.normal, i, witness.normal[0], witness.normal[1], witness.normal[2]);
  if (to.status != nullptr) to.status[i] = status;
  if (to.node_visits != nullptr) to.node_visits[i] = visits;
  if (to.sphere_pairs != nullptr) to.sphere_pairs[i] = spheres;
}

/// World units, as separation(). By one lane.
template <class Real>
IST_HD void finish_separation(const SeparationArrays& batch, std::uint32_t i,
                              const GapMemory<Real>& memory, const GapTotals& totals) {
  const QueryStatus status = totals.out_of_time != 0 && !totals.overlap()
                                 ? QueryStatus::budget_exhausted
                                 : QueryStatus::ok;
  double distance[3] = {0, 0, 0};
  GapWitness witness = {};
  if (!totals.overlap()) {
    const PairPlace& place = memory.place;
    const double* const origin = place.origin_a;
    const double unit = place.unit_a;
    const double length =
        span_of(memory.tree[0], memory.cover[0], memory.tree[1], memory.cover[1], place.a_from_b);
    const double off =
        root((origin[0] * origin[0] + origin[1] * origin[1]) + origin[2] * origin[2]);
    const double error = gap_error<double>(length) + 1e-15 * off / unit;
    // What far apart was not told apart (GapDescent), covers have not yet.
    const double least = totals.cover - gap_error<double>(length) - error;
    distance[0] = unit * totals.gap;
    distance[1] = least > 0 ? unit * least : 0;
    distance[2] = unit * (totals.gap + error);

    const NodeBall a = memory.tree[0].ball(kSphereLevel, totals.a);
    const NodeBall b = memory.tree[1].ball(kSphereLevel, totals.b);
    double moved[3], axis[3], length2 = 0;
    place.a_from_b.apply(b.centre, moved);
    for (int k = 0; k < 3; ++k) {
      axis[k] = moved[k] - a.centre[k];
      length2 += axis[k] * axis[k];
    }
    const double norm = root(length2), radius_b = place.a_from_b.scale * b.r;
    for (int k = 0; k < 3; ++k) axis[k] /= norm;
    for (int row = 0; row < 3; ++row) {
      const double* const r = place.rotation_a + 3 * row;
      double on_a = 0, on_b = 0;
      for (int k = 0; k < 3; ++k) {
        on_a += r[k] * (unit * (a.centre[k] + a.r * axis[k]));
        on_b += r[k] * (unit * (moved[k] - radius_b * axis[k]));
        witness.normal[row] += r[k] * axis[k];
      }
      witness.point_a[row] = on_a + origin[row];
      witness.point_b[row] = on_b + origin[row];
    }
  }
  write_separation(batch.answers, i, status, distance, witness, totals.visits, totals.spheres);
}

/// Which list pair i goes to: 0 float, 1 double; −1: it is answered. One thread a pair.
IST_HD inline int sift_separation(const SeparationArrays& batch, std::uint32_t i) {
  PairPlace place;
  const QueryStatus placed = place_trees(batch.pairs, i, place);
  if (placed != QueryStatus::ok) {
    const double none = nothing(placed);
    const double distance[3] = {none, none, none};
    const GapWitness witness = {{none, none, none}, {none, none, none}, {none, none, none}};
    write_separation(batch.answers, i, placed, distance, witness, 0, 0);
    return -1;
  }
  const SolidRef& a = solid_of(batch.pairs, batch.pairs.pairs.a, i);
  const SolidRef& b = solid_of(batch.pairs, batch.pairs.pairs.b, i);
  const TreeRef& tree_a = a.tree[static_cast<int>(Measure::inner)];
  const TreeRef& tree_b = b.tree[static_cast<int>(Measure::inner)];
  // As precision_for_gap() (query/base/precision.h).
  const double ra = tree_a.root[3], rb = tree_b.root[3] * place.a_from_b.scale;
  const bool alike = rb <= kSingleRatio * ra && ra <= kSingleRatio * rb;
  const double length = span_of(tree_a, a.cover, tree_b, b.cover, place.a_from_b);
  return alike && length <= kSingleRatio * (ra + rb) ? 0 : 1;
}

/// Readies the memory for pair i.
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

/// Leaves what waits to others; false if there is no room. All of the team together.
template <class Team, class Real>
IST_HD bool split_separation(const Team& team, const SeparationArrays& batch, std::uint32_t i,
                             const GapMemory<Real>& memory, int waiting) {
  const SplitRoom room = take_room(team, batch.pairs, batch.counters[sizeof(Real) == 4 ? 0 : 1], i,
                                   waiting, [&](int top) { return gap_task_floor(memory, top); });
  if (!room.fits) return false;
  if (team.lane() == 0) batch.totals[room.split] = memory.before;
  for (int k = team.lane(); k < waiting; k += Team::kWidth) {
    const std::uint32_t at = room.first_entry + static_cast<std::uint32_t>(k);
    batch.entries.a[at] = memory.stack_a[k];
    batch.entries.b[at] = memory.stack_b[k];
    batch.entries.gap[at] = static_cast<double>(memory.stack_gap[k]);
    batch.entries.cover[at] = static_cast<double>(memory.stack_cover[k]);
  }
  return true;
}

/// Visits of each of `tasks` after the first ones of a pair.
IST_HD inline std::uint32_t task_visits(std::uint32_t max_visits, std::uint32_t tasks) {
  return max_visits == ~0u ? max_visits : (max_visits - kGapsAlone) / tasks;
}

/// Searches pair i, or as much of it as one team is to do alone.
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
    // The tasks one by one, each as if others were doing the rest.
    floor = gap_task_floor(memory, descent.waiting());
    descent.restart(memory.before);
  }
  if (team.lane() == 0) finish_separation(batch, i, memory, memory.sum);
  team.sync();
}

/// Searches a task; who does a pair's last writes the answer.
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
    GapTotals* const of_tasks = batch.totals + batch.pairs.split_room;
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
