#pragma once

#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/batch_arrays.h"
#include "cuda/query/coincidence.h"
#include "cuda/query/part_sums.h"
#include "numerics/host_device.h"

// A batch of pairs of trees, step by step: what a kernel's threads and warps do, and a test's
// threads on the host. An answer depends on its pair alone: neither on the others nor on who sums
// what.

namespace ist::gpu {

/// Pairs of leaf blocks that a descent meets before it is split, and the weight of a task.
constexpr std::uint32_t kMostAlone = 96;
constexpr std::uint32_t kTaskWeight = 16;
/// Sums whose rounding may exceed this share are taken again in double.
constexpr double kGrazingPair = 1e-5;
/// From this ratio of sizes on all is in double.
constexpr double kFloatRatio = 64;

IST_HD inline void write3(double* to, std::uint32_t i, double x, double y, double z) {
  if (to == nullptr) return;
  to[3 * std::uint64_t{i}] = x;
  to[3 * std::uint64_t{i} + 1] = y;
  to[3 * std::uint64_t{i} + 2] = z;
}

IST_HD inline void write_nothing(const GpuPenetrations& to, std::uint32_t i, QueryStatus status) {
  if (to.volume != nullptr) to.volume[i] = 0;
  write3(to.centroid, i, 0, 0, 0);
  write3(to.translation_gradient, i, 0, 0, 0);
  write3(to.rotation_gradient, i, 0, 0, 0);
  if (to.status != nullptr) to.status[i] = status;
  if (to.node_visits != nullptr) to.node_visits[i] = 0;
  if (to.sphere_pairs != nullptr) to.sphere_pairs[i] = 0;
}

/// World units, as world_answer() (query/descent/answer.h).
IST_HD inline void write_answer(const GpuPenetrations& to, std::uint32_t i, const PairPlace& place,
                                const LensTotals& totals) {
  const double unit = place.unit_a, unit3 = unit * unit * unit;
  const double* const t = totals.term;
  if (to.volume != nullptr) to.volume[i] = unit3 * (kPi / 3) * t[kCaps];
  double centre[3] = {0, 0, 0}, push[3], turn[3];
  for (int row = 0; row < 3; ++row) {
    const double* const r = place.rotation_a + 3 * row;
    push[row] =
        -2 * kPi * unit * unit * (r[0] * t[kForce] + r[1] * t[kForce + 1] + r[2] * t[kForce + 2]);
    turn[row] =
        -2 * kPi * unit3 * (r[0] * t[kTorque] + r[1] * t[kTorque + 1] + r[2] * t[kTorque + 2]);
    if (!(t[kCaps] > 0)) continue;
    double moment = 0;
    for (int k = 0; k < 3; ++k) moment += r[k] * (t[kMoment + k] / t[kCaps] + place.a_from_b.t[k]);
    centre[row] = place.origin_a[row] + unit * moment;
  }
  const double* const o = place.offset_b;
  write3(to.centroid, i, centre[0], centre[1], centre[2]);
  write3(to.translation_gradient, i, push[0], push[1], push[2]);
  write3(to.rotation_gradient, i, turn[0] + (o[1] * push[2] - o[2] * push[1]),
         turn[1] + (o[2] * push[0] - o[0] * push[2]), turn[2] + (o[0] * push[1] - o[1] * push[0]));
  if (to.status != nullptr) to.status[i] = QueryStatus::ok;
  if (to.node_visits != nullptr) to.node_visits[i] = totals.visits;
  if (to.sphere_pairs != nullptr) to.sphere_pairs[i] = totals.spheres;
}

IST_HD inline Pose pose_of(const Pose* poses, std::uint32_t i) {
  return poses != nullptr ? poses[i] : Pose{{1, 0, 0, 0}, {0, 0, 0}};
}
IST_HD inline double scale_of(const double* scales, std::uint32_t i) {
  return scales != nullptr ? scales[i] : 1;
}

/// Copies what is plain words.
template <class Team, class T>
IST_HD void copy_words(const Team& team, const T& from, T& to) {
  const auto* const source = reinterpret_cast<const std::uint32_t*>(&from);
  auto* const target = reinterpret_cast<std::uint32_t*>(&to);
  for (int k = team.lane(); k < static_cast<int>(sizeof(T) / 4); k += Team::kWidth)
    target[k] = source[k];
}

/// Places pair i; false if it cannot be.
IST_HD inline bool place_pair(const BatchArrays& batch, std::uint32_t i, PairPlace& place) {
  const GpuPairs& pairs = batch.pairs;
  const std::uint32_t a = pairs.asset_a[i], b = pairs.asset_b[i];
  if (a >= batch.asset_count || b >= batch.asset_count) return false;
  return place.place(batch.assets[a].frame, pose_of(pairs.pose_a, i), scale_of(pairs.scale_a, i),
                     batch.assets[b].frame, pose_of(pairs.pose_b, i), scale_of(pairs.scale_b, i));
}

/// Square of the distance of B's finest root from A's, A's unit frame.
IST_HD inline double root_distance2(const TreeRef& a, const TreeRef& b, const PairPlace& place) {
  const double centre[3] = {b.root[0], b.root[1], b.root[2]};
  double moved[3], d2 = 0;
  place.a_from_b.apply(centre, moved);
  for (int k = 0; k < 3; ++k) d2 += (moved[k] - a.root[k]) * (moved[k] - a.root[k]);
  return d2;
}

/// Which list pair i goes to when the finest trees are asked: 0 float, 1 double; −1: it is
/// answered.
IST_HD inline int sift_finest(const BatchArrays& batch, std::uint32_t i, const PairPlace& place) {
  const auto measure = static_cast<std::uint32_t>(batch.measure);
  const TreeRef& a = batch.assets[batch.pairs.asset_a[i]].tree[measure];
  const TreeRef& b = batch.assets[batch.pairs.asset_b[i]].tree[measure];
  const double rb = b.root[3] * place.a_from_b.scale, reach = a.root[3] + rb;
  if (!(root_distance2(a, b, place) < reach * reach)) {
    write_nothing(batch.answers, i, QueryStatus::ok);
    return -1;
  }
  return rb <= kFloatRatio * a.root[3] && a.root[3] <= kFloatRatio * rb ? 0 : 1;
}

/// Whether pair i may ask for other levels of detail than the finest: under a budget, as long as
/// any levels may meet; without one, copies of an asset that all but coincide.
IST_HD inline bool needs_details(const BatchArrays& batch, std::uint32_t i,
                                 const PairPlace& place) {
  if (batch.measure != Measure::matched) return false;
  const AssetRef& a = batch.assets[batch.pairs.asset_a[i]];
  const AssetRef& b = batch.assets[batch.pairs.asset_b[i]];
  if (a.details.coarser == 0 && b.details.coarser == 0) return false;
  if (batch.pair_budget > 0) {
    const double reach = a.details.reach + b.details.reach * place.a_from_b.scale;
    return root_distance2(a.tree[0], b.tree[0], place) < reach * reach;
  }
  return a.details.first_alike == b.details.first_alike &&
         Coincidence(a.tree[0].root, a.details.mean_radius, place.a_from_b).weight > 0;
}

/// The lists of pairs.
constexpr int kInFloat = 0, kInDouble = 1, kDetailed = 2;

/// Which list pair i goes to; −1: it is answered. One thread a pair.
IST_HD inline int sift_pair(const BatchArrays& batch, std::uint32_t i) {
  PairPlace place;
  if (!place_pair(batch, i, place)) {
    write_nothing(batch.answers, i, QueryStatus::invalid_input);
    return -1;
  }
  return needs_details(batch, i, place) ? kDetailed : sift_finest(batch, i, place);
}

/// Readies the memory for pair i.
template <class Team, class Real>
IST_HD void load_pair(const Team& team, const BatchArrays& batch, std::uint32_t i,
                      PairMemory<Real>& memory) {
  if (team.lane() == 0) place_pair(batch, i, memory.place);
  const auto measure = static_cast<std::uint32_t>(batch.measure);
  const std::uint32_t asset[2] = {batch.pairs.asset_a[i], batch.pairs.asset_b[i]};
  for (int side = 0; side < 2; ++side)
    copy_words(team, batch.assets[asset[side]].tree[measure], memory.tree[side]);
  team.sync();
}

/// Writes the answer, or lists the pair again where float is too rough. By one lane.
template <class Real>
IST_HD void finish_pair(const BatchArrays& batch, std::uint32_t i, const PairPlace& place,
                        const LensTotals& totals) {
  // 2π over π/3: the terms' factors.
  if (sizeof(Real) == 4 && 6 * totals.term[kError] > kGrazingPair * totals.term[kCaps] &&
      totals.term[kCaps] > 0) {
    batch.list[1][atomic_add(&batch.counters->listed[1], 1)] = i;
    return;
  }
  write_answer(batch.answers, i, place, totals);
}

/// The lowest entry of the task that begins with the topmost of `waiting` entries.
template <class Real>
IST_HD int task_floor(const PairMemory<Real>& memory, int waiting) {
  std::uint32_t weight = 0;
  while (waiting > 0 && weight < kTaskWeight) {
    const int left =
        memory.steps.count - 1 - static_cast<int>(memory.stack_a[waiting - 1] >> kNodeBits);
    weight += left >= 2 ? kTaskWeight : 1u << 2 * left;
    --waiting;
  }
  return waiting;
}

/// Leaves what waits to others; false if there is no room. All of the team together.
template <class Team, class Real>
IST_HD bool split_pair(const Team& team, const BatchArrays& batch, std::uint32_t i,
                       PairMemory<Real>& memory, int waiting) {
  constexpr int kKind = sizeof(Real) == 4 ? 0 : 1;
  int tasks = 0;
  for (int top = waiting; top > 0; ++tasks) top = task_floor(memory, top);
  std::uint32_t split = 0, task = 0, entry = 0;
  if (team.lane() == 0) {
    BatchCounters& counters = *batch.counters;
    split = atomic_add(&counters.splits[kKind], 1);
    task = atomic_add(&counters.tasks[kKind], static_cast<std::uint32_t>(tasks));
    entry = atomic_add(&counters.entries[kKind], static_cast<std::uint32_t>(waiting));
  }
  split = team.broadcast(split, 0);
  task = team.broadcast(task, 0);
  entry = team.broadcast(entry, 0);
  const bool fits = split < batch.split_room &&
                    task + static_cast<std::uint32_t>(tasks) <= batch.task_room &&
                    entry + static_cast<std::uint32_t>(waiting) <= batch.entry_room;
  if (team.lane() == 0) {
    // Room that was taken and does not do stays unused: its tasks hold nothing.
    int top = waiting;
    for (int k = 0; k < tasks; ++k) {
      const int floor = task_floor(memory, top);
      const std::uint32_t at = task + static_cast<std::uint32_t>(k);
      if (at < batch.task_room)
        batch.tasks[at] = {split, entry + static_cast<std::uint32_t>(floor),
                           fits ? static_cast<std::uint32_t>(top - floor) : 0};
      top = floor;
    }
    if (fits) {
      batch.splits[split] = {i, task, static_cast<std::uint32_t>(tasks),
                             static_cast<std::uint32_t>(tasks)};
      batch.totals[split] = memory.totals;
    }
  }
  if (!fits) return false;
  for (int k = team.lane(); k < waiting; k += Team::kWidth) {
    batch.entries_a[entry + static_cast<std::uint32_t>(k)] = memory.stack_a[k];
    batch.entries_b[entry + static_cast<std::uint32_t>(k)] = memory.stack_b[k];
  }
  return true;
}

/// Sums pair i, or as much of it as one team is to do alone.
template <class Team, class Real>
IST_HD void sum_pair(const Team& team, const BatchArrays& batch, std::uint32_t i,
                     PairMemory<Real>& memory) {
  load_pair(team, batch, i, memory);
  PairDescent<Team, Real> descent(team, memory);
  descent.start();
  descent.run(0, kMostAlone);
  if (descent.waiting() > 0) {
    if (split_pair(team, batch, i, memory, descent.waiting())) return;
    // The tasks one by one, and their sums added up as if others had done them.
    LensTotals sum = memory.totals;
    while (descent.waiting() > 0) {
      if (team.lane() == 0) memory.totals.clear();
      const int floor = task_floor(memory, descent.waiting());
      team.sync();
      descent.run(floor, ~0u);
      sum.add(memory.totals);
      team.sync();
    }
    if (team.lane() == 0) memory.totals = sum;
  }
  team.sync();
  if (team.lane() == 0) finish_pair<Real>(batch, i, memory.place, memory.totals);
  team.sync();
}

/// Sums a task; who does a pair's last writes the answer.
template <class Team, class Real>
IST_HD void sum_task(const Team& team, const BatchArrays& batch, std::uint32_t index,
                     PairMemory<Real>& memory) {
  const PairTask task = batch.tasks[index];
  if (task.count == 0) return;
  SplitPair& split = batch.splits[task.split];
  load_pair(team, batch, split.pair, memory);
  PairDescent<Team, Real> descent(team, memory);
  descent.resume(batch.entries_a + task.first, batch.entries_b + task.first,
                 static_cast<int>(task.count));
  descent.run(0, ~0u);
  if (team.lane() == 0) {
    batch.totals[batch.split_room + index] = memory.totals;
    publish();
    if (atomic_add(&split.left, ~0u) == 1) {
      publish();
      LensTotals sum = batch.totals[task.split];
      for (std::uint32_t k = 0; k < split.tasks; ++k)
        sum.add(batch.totals[batch.split_room + split.first_task + k]);
      finish_pair<Real>(batch, split.pair, memory.place, sum);
    }
  }
  team.sync();
}

}  // namespace ist::gpu
