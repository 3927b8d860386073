#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"
#include "cuda/base/atomics.h"
#include "cuda/query/answers.h"
#include "cuda/query/batch_arrays.h"
#include "query/lod/level_pair.h"

// The steps of a batch of pairs of trees, for the threads and warps of kernels and for tests on the
// host. An answer depends only on its pair and on how finely the batch is split
// (BatchArrays::cut_for()), neither on other pairs nor on which team sums what.

namespace ist::gpu {

IST_HD inline Pose pose_of(const GpuPlacedSolids& side, std::uint32_t i) {
  return side.pose != nullptr ? side.pose[i] : Pose{{1, 0, 0, 0}, {0, 0, 0}};
}
IST_HD inline double scale_of(const GpuPlacedSolids& side, std::uint32_t i) {
  return side.scale != nullptr ? side.scale[i] : 1;
}

/// Copies an object word by word.
template <class Team, class T>
IST_HD void copy_words(const Team& team, const T& from, T& to) {
  const auto* const source = reinterpret_cast<const std::uint32_t*>(&from);
  auto* const target = reinterpret_cast<std::uint32_t*>(&to);
  for (int k = team.lane(); k < static_cast<int>(sizeof(T) / 4); k += Team::kWidth)
    target[k] = source[k];
}

/// The kinds of solids in a pair. `missing`: an index is out of range.
enum class PairKind { missing, trees, tree_and_field, fields };

IST_HD inline PairKind kind_of(const SolidPairs& batch, std::uint32_t i) {
  const std::uint32_t a = batch.pairs.a.solid[i], b = batch.pairs.b.solid[i];
  if (a >= batch.solid_count || b >= batch.solid_count) return PairKind::missing;
  const bool field_a = batch.solids[a].is_field(), field_b = batch.solids[b].is_field();
  return field_a && field_b   ? PairKind::fields
         : field_a || field_b ? PairKind::tree_and_field
                              : PairKind::trees;
}

IST_HD inline const SolidRef& solid_of(const SolidPairs& batch, const GpuPlacedSolids& side,
                                       std::uint32_t i) {
  return batch.solids[side.solid[i]];
}

/// [u³] The smaller solid's volume, an upper bound of the overlap of pair i.
IST_HD inline double smaller_volume(const SolidPairs& batch, std::uint32_t i) {
  const auto volume = [&](const GpuPlacedSolids& side) {
    const double scale = scale_of(side, i);
    return solid_of(batch, side, i).volume * (scale * scale * scale);
  };
  return std::fmin(volume(batch.pairs.a), volume(batch.pairs.b));
}

/// Computes the pose of B in A's frame for pair i; false if a pose or scale is invalid.
IST_HD inline bool place_pair(const SolidPairs& batch, const GpuPlacedSolids& a,
                              const GpuPlacedSolids& b, std::uint32_t i, PairPlace& place) {
  return place.place<Quotients::by_reciprocal>(solid_of(batch, a, i).frame, pose_of(a, i),
                                               scale_of(a, i), solid_of(batch, b, i).frame,
                                               pose_of(b, i), scale_of(b, i));
}
IST_HD inline bool place_pair(const SolidPairs& batch, std::uint32_t i, PairPlace& place) {
  return place_pair(batch, batch.pairs.a, batch.pairs.b, i, place);
}

/// The same with the CPU's divisions, so that the digits are those of the CPU.
IST_HD_COLD bool place_exactly(const SolidPairs& batch, const GpuPlacedSolids& a,
                               const GpuPlacedSolids& b, std::uint32_t i, PairPlace& place) {
  return place.place(solid_of(batch, a, i).frame, pose_of(a, i), scale_of(a, i),
                     solid_of(batch, b, i).frame, pose_of(b, i), scale_of(b, i));
}
IST_HD inline bool place_exactly(const SolidPairs& batch, std::uint32_t i, PairPlace& place) {
  return place_exactly(batch, batch.pairs.a, batch.pairs.b, i, place);
}

/// Places pair i of two trees. Any other kind of pair has a status that is not ok.
IST_HD inline QueryStatus place_trees(const SolidPairs& batch, std::uint32_t i, PairPlace& place) {
  const PairKind kind = kind_of(batch, i);
  if (kind == PairKind::tree_and_field || kind == PairKind::fields)
    return QueryStatus::missing_data;
  if (kind == PairKind::trees && !(solid_of(batch, batch.pairs.a, i).has_spheres() &&
                                   solid_of(batch, batch.pairs.b, i).has_spheres()))
    return QueryStatus::missing_data;
  return kind == PairKind::trees && place_pair(batch, i, place) ? QueryStatus::ok
                                                                : QueryStatus::invalid_input;
}

/// The number of intersecting pairs of children of two roots, up to rounding. Counting stops at
/// `most`.
IST_HD inline std::uint32_t children_that_meet(const TreeRef& a, const TreeRef& b,
                                               const Similarity& map, std::uint32_t most) {
  const BallBlock& of_a = in_global_memory(a.blocks[a.top])[0];
  const BallBlock& of_b = in_global_memory(b.blocks[b.top])[0];
  const Origin& from_a = a.origins[a.top][0];
  const Origin& from_b = b.origins[b.top][0];
  const auto scale = static_cast<float>(map.scale);
  std::uint32_t meet = 0;
  IST_ROLLED
  for (std::uint32_t j = 0; j < kWidth && meet < most; ++j) {
    if (!(of_b.r[j] > 0)) continue;
    double moved[3];
    map.apply_fused(lane_ball(of_b, from_b, j).centre, moved);
    const auto x = static_cast<float>(moved[0] - from_a.x);
    const auto y = static_cast<float>(moved[1] - from_a.y);
    const auto z = static_cast<float>(moved[2] - from_a.z);
    const float r = of_b.r[j] * scale;
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      const float dx = of_a.x[i] - x, dy = of_a.y[i] - y, dz = of_a.z[i] - z;
      const float reach = (of_a.r[i] + r) * (1 + kTolerance);
      const bool meets =
          of_a.r[i] > 0 && std::fma(dx, dx, std::fma(dy, dy, dz * dz)) < reach * reach;
      meet += meets ? 1 : 0;
    }
  }
  return meet < most ? meet : most;
}

/// The squared distance of the finest roots' centres, A's unit frame.
IST_HD inline double root_distance2(const TreeRef& a, const TreeRef& b, const PairPlace& place) {
  const double centre[3] = {b.root[0], b.root[1], b.root[2]};
  double moved[3], d2 = 0;
  place.a_from_b.apply_fused(centre, moved);
  for (int k = 0; k < 3; ++k) d2 += (moved[k] - a.root[k]) * (moved[k] - a.root[k]);
  return d2;
}

/// The size of the sum of pair i's finest trees, as children_that_meet() counts. 0: pair i is
/// answered already.
IST_HD inline std::uint32_t sift_finest(const BatchArrays& batch, std::uint32_t i,
                                        const PairPlace& place) {
  const auto measure = static_cast<std::uint32_t>(batch.measure);
  const TreeRef& a = solid_of(batch, batch.pairs.a, i).tree[measure];
  const TreeRef& b = solid_of(batch, batch.pairs.b, i).tree[measure];
  const double reach = a.root[3] + b.root[3] * place.a_from_b.scale;
  if (root_distance2(a, b, place) < reach * reach) {
    const std::uint32_t meet =
        children_that_meet(a, b, place.a_from_b, batch.size_capacity > 0 ? kWidth * kWidth : 1);
    if (meet > 0) return meet;
  }
  write_nothing(batch.answers, i, QueryStatus::ok);
  return 0;
}

/// Lists pair i at position `at`, or in the list of its size class (sift_finest()).
IST_HD inline void list_pair(const BatchArrays& batch, std::uint32_t i, std::uint32_t meet,
                             std::uint32_t at) {
  std::uint32_t size = batch.size_capacity > 0 ? kSizes - 1 : 0;
  if (batch.size_capacity > 0) {
    for (; meet > 1; meet /= 2) --size;
    at = atomic_add(&batch.counters->of_size[size], 1);
  }
  batch.list[std::uint64_t{size} * batch.size_capacity + at] = i;
}

IST_HD inline std::uint32_t listed_pair(const BatchArrays& batch, std::uint32_t k) {
  if (batch.size_capacity == 0) return batch.list[k];
  std::uint32_t size = 0;
  for (; k >= batch.counters->of_size[size]; ++size) k -= batch.counters->of_size[size];
  return batch.list[std::uint64_t{size} * batch.size_capacity + k];
}

/// True if pair i may need other levels of detail than the finest: under a budget, if any levels
/// may intersect; without one, for copies of an asset that nearly coincide.
IST_HD inline bool needs_details(const BatchArrays& batch, std::uint32_t i,
                                 const PairPlace& place) {
  if (batch.measure != Measure::matched) return false;
  const SolidRef& a = solid_of(batch, batch.pairs.a, i);
  const SolidRef& b = solid_of(batch, batch.pairs.b, i);
  if (a.details.coarser == 0 && b.details.coarser == 0) return false;
  if (batch.pair_budget > 0) {
    const double reach = a.details.reach + b.details.reach * place.a_from_b.scale;
    return root_distance2(a.tree[0], b.tree[0], place) < reach * reach;
  }
  return a.details.first_alike == b.details.first_alike &&
         coincidence_weight(a.tree[0].root, a.details.mean_radius, place.a_from_b).weight > 0;
}

enum class PairUse { answered, summed, detailed };

/// Decides what pair i needs, and the size of its sum. One thread per pair.
IST_HD inline PairUse sift_pair(const BatchArrays& batch, std::uint32_t i, std::uint32_t& meet) {
  PairPlace place;
  const QueryStatus status = place_trees(batch, i, place);
  if (status != QueryStatus::ok) {
    // field_steps.h handles a tree and a field.
    if (kind_of(batch, i) != PairKind::tree_and_field) write_nothing(batch.answers, i, status);
    return PairUse::answered;
  }
  if (needs_details(batch, i, place)) return PairUse::detailed;
  meet = sift_finest(batch, i, place);
  return meet > 0 ? PairUse::summed : PairUse::answered;
}

/// Loads pair i into memory. Its place is set, or will be after the team's next sync.
template <class Team, class Memory>
IST_HD void load_trees(const Team& team, const BatchArrays& batch, std::uint32_t i,
                       Memory& memory) {
  const auto measure = static_cast<std::uint32_t>(batch.measure);
  copy_words(team, solid_of(batch, batch.pairs.a, i).tree[measure], memory.tree[0]);
  copy_words(team, solid_of(batch, batch.pairs.b, i).tree[measure], memory.tree[1]);
  team.sync();
}

/// The approximate cost of a pending entry, in pairs of leaves.
IST_HD inline std::uint32_t weight_of(const PairMemory& memory, int entry) {
  constexpr int kMostLeft = 8;  // for all entries' sum to be an int
  const int left = memory.steps.count - 1 - static_cast<int>(memory.stack_a[entry] >> kNodeBits);
  return 1u << 2 * (left < kMostLeft ? left : kMostLeft);
}

/// The approximate number of tasks of a pair, no more than get their own warps in a small batch.
constexpr std::uint32_t kTasksOfPair = 12;

/// Chooses the size of the tasks for pending entries: at least batch.task_weight, and not too many.
/// Called by the whole team.
template <class Team>
IST_HD void size_tasks(const Team& team, const BatchArrays& batch, PairMemory& memory,
                       int waiting) {
  int weight = 0;
  for (int k = team.lane(); k < waiting; k += Team::kWidth)
    weight += static_cast<int>(weight_of(memory, k));
  const std::uint32_t each = static_cast<std::uint32_t>(team.sum(weight)) / kTasksOfPair;
  if (team.lane() == 0) memory.task_weight = each > batch.task_weight ? each : batch.task_weight;
  team.sync();
}

/// The lowest entry of the task that begins with the topmost of `waiting` entries.
IST_HD inline int task_floor(const PairMemory& memory, int waiting) {
  const int top = waiting;
  std::uint32_t weight = 0;
  while (waiting > 0 && weight < memory.task_weight && top - waiting < kTaskStack)
    weight += weight_of(memory, --waiting);
  return waiting;
}

/// The memory in which a traversal leaves its pending entries, if they fit.
struct SplitSlots {
  bool fits;
  std::uint32_t split;
  std::uint32_t first_entry;
  std::uint32_t first_task, tasks;  ///< taken, whether it fits or not
};

/// Reserves memory for the `waiting` entries of pair i and lists their tasks. Called by the whole
/// team.
///
/// `floor_of(top)`: the lowest entry of the task that begins below entry `top`.
template <class Team, class FloorOf>
IST_HD SplitSlots reserve_split(const Team& team, const BatchArrays& batch, BatchCounters& counters,
                                std::uint32_t i, int waiting, const FloorOf& floor_of) {
  std::uint32_t tasks = 0;
  for (int top = waiting; top > 0; ++tasks) top = floor_of(top);
  const auto entries = static_cast<std::uint32_t>(waiting);
  std::uint32_t split = 0, task = 0, entry = 0, fits = 0, taken = 0;
  // Counters stop growing soon after memory is full, so that no batch makes them overflow.
  if (team.lane() == 0 && atomic_load(&counters.splits) < batch.split_capacity &&
      atomic_load(&counters.tasks) < batch.task_capacity &&
      atomic_load(&counters.entries) < batch.entry_capacity) {
    taken = tasks;
    split = atomic_add(&counters.splits, 1);
    task = atomic_add(&counters.tasks, tasks);
    entry = atomic_add(&counters.entries, entries);
    const bool all = split < batch.split_capacity && task + tasks <= batch.task_capacity &&
                     entry + entries <= batch.entry_capacity;
    fits = all ? 1 : 0;
    // Memory that was reserved but does not suffice stays unused, and its tasks are empty.
    int top = waiting;
    for (std::uint32_t k = 0; k < tasks; ++k) {
      const int floor = floor_of(top);
      if (task + k < batch.task_capacity)
        batch.tasks[task + k] = {split, entry + static_cast<std::uint32_t>(floor),
                                 all ? static_cast<std::uint32_t>(top - floor) : 0};
      top = floor;
    }
    if (all) batch.splits[split] = {i, task, tasks, tasks};
  }
  return {team.broadcast(fits, 0) != 0, team.broadcast(split, 0), team.broadcast(entry, 0),
          team.broadcast(task, 0), team.broadcast(taken, 0)};
}

/// Leaves the pending entries to other teams; false if there is no memory. Called by the whole
/// team.
template <class Team>
IST_HD bool split_pair(const Team& team, const BatchArrays& batch, std::uint32_t i,
                       PairMemory& memory, int waiting) {
  const SplitSlots work = reserve_split(team, batch, *batch.counters, i, waiting,
                                        [&](int top) { return task_floor(memory, top); });
  if (work.fits) {
    if (team.lane() == 0) batch.totals[work.split] = memory.sum;
    copy_words(team, memory.place, batch.places[work.split]);
    for (int k = team.lane(); k < waiting; k += Team::kWidth) {
      batch.entries_a[work.first_entry + static_cast<std::uint32_t>(k)] = memory.stack_a[k];
      batch.entries_b[work.first_entry + static_cast<std::uint32_t>(k)] = memory.stack_b[k];
    }
  }
  team.sync();
  publish();
  for (std::uint32_t k = work.first_task + static_cast<std::uint32_t>(team.lane());
       k < work.first_task + work.tasks; k += static_cast<std::uint32_t>(Team::kWidth))
    if (k < batch.task_capacity) atomic_exchange(&batch.posted[k], 1);
  return work.fits;
}

/// The pairs at the end of a list that may leave tasks. Earlier, no team is idle.
IST_HD inline std::uint32_t pairs_handed_out(std::uint32_t listed, std::uint32_t last) {
  return listed < last ? listed : last;
}

/// 1 if task k can be taken, −1 if not yet, 0 if there is none. `most`: the number of pairs that
/// may leave tasks.
IST_HD inline int look_for_task(const BatchArrays& batch, std::uint32_t k, std::uint32_t most) {
  if (k < batch.task_capacity && atomic_load(&batch.posted[k]) != 0) {
    publish();
    return 1;
  }
  if (k < batch.task_capacity && atomic_load(&batch.counters->handed_out) < most) return -1;
  publish();
  const std::uint32_t tasks = atomic_load(&batch.counters->tasks);
  return k < tasks && k < batch.task_capacity ? -1 : 0;
}

struct PlacedPair {
  PairPlace place;
  std::uint32_t pair;  ///< in the batch
  std::uint32_t at;    ///< in the list
};

/// The number of pairs that a team places ahead. Each lane places one, so a few take as long as
/// one.
constexpr int kPlacedAhead = 2;

/// The state of a team that sums pairs and tasks. It is not in registers, since the traversal needs
/// all of them.
struct WorkMemory : PairMemory {
  bool is_task;
  bool hand_out;       ///< of a pair: if large, it may leave tasks to other teams
  std::uint32_t pair;  ///< in the batch
  std::uint32_t at;    ///< the position of a pair in the list, of a task among tasks
  PairTask task;
  int waiting;  ///< pairs that are placed ahead
  PlacedPair ahead[kPlacedAhead];
};

/// Places pairs `first` … of the list: the first becomes current, the others are kept ahead.
template <class Team>
IST_HD void place_pairs(const Team& team, const BatchArrays& batch, std::uint32_t first,
                        std::uint32_t count, WorkMemory& memory) {
  for (auto k = static_cast<std::uint32_t>(team.lane()); k < count;
       k += static_cast<std::uint32_t>(Team::kWidth)) {
    const std::uint32_t pair = listed_pair(batch, first + k);
    PlacedPair& waits = memory.ahead[k > 0 ? count - 1 - k : 0];
    (k > 0 ? waits.pair : memory.pair) = pair;
    (k > 0 ? waits.at : memory.at) = first + k;
    place_pair(batch, pair, k > 0 ? waits.place : memory.place);
  }
  if (team.lane() == 0) memory.waiting = static_cast<int>(count) - 1;
  team.sync();
}

/// Makes a pair that was placed ahead the current one.
template <class Team>
IST_HD void take_placed(const Team& team, WorkMemory& memory) {
  const int k = memory.waiting - 1;
  const PlacedPair& from = memory.ahead[k];
  copy_words(team, from.place, memory.place);
  team.sync();
  if (team.lane() == 0) {
    memory.pair = from.pair;
    memory.at = from.at;
    memory.waiting = k;
  }
  team.sync();
}

/// Makes a task the current one; false if its pair found no memory for all of its tasks.
template <class Team>
IST_HD bool take_task(const Team& team, const BatchArrays& batch, WorkMemory& memory) {
  const std::uint32_t at = memory.at;
  const PairTask task = batch.tasks[at];
  team.sync();
  if (team.lane() == 0) batch.posted[at] = 0;
  if (task.count == 0) return false;
  const SplitPair& split = batch.splits[task.split];
  if (team.lane() == 0) {
    memory.task = task;
    memory.pair = split.pair;
  }
  copy_words(team, batch.places[task.split], memory.place);
  team.sync();
  return true;
}

/// Adds up the sums of a pair's tasks if this was the last one. Called by a team's first lane.
IST_HD inline bool end_task(const BatchArrays& batch, WorkMemory& memory) {
  SplitPair& split = batch.splits[memory.task.split];
  batch.totals[batch.split_capacity + memory.at] = memory.totals;
  publish();
  if (atomic_add(&split.left, ~0u) != 1) return false;
  publish();
  memory.sum = batch.totals[memory.task.split];
  for (std::uint32_t k = 0; k < split.tasks; ++k)
    memory.sum.add(batch.totals[batch.split_capacity + split.first_task + k]);
  return true;
}

/// Sums the current task, or the current pair except for the part that it leaves to tasks. The team
/// that finishes a pair's last part writes the answer.
template <class Team>
IST_HD void do_work(const Team& team, const BatchArrays& batch, WorkMemory& memory) {
  load_trees(team, batch, memory.pair, memory);
  PairDescent<Team> descent(team, memory);
  if (memory.is_task)
    descent.resume(batch.entries_a + memory.task.first, batch.entries_b + memory.task.first,
                   static_cast<int>(memory.task.count));
  else
    descent.start();
  if (team.lane() == 0) memory.sum.clear();
  // Tasks that are not handed out are done one by one. Their sums are added as if other teams had
  // done them.
  int floor = 0;
  bool whole = memory.is_task;  // no task is cut again
  for (;;) {
    descent.run(floor, whole ? ~0u : batch.most_alone);
    if (memory.is_task) break;
    if (team.lane() == 0) {
      memory.sum.add(memory.totals);
      memory.totals.clear();
    }
    team.sync();
    if (descent.waiting() == 0) break;
    if (!whole) {
      size_tasks(team, batch, memory, descent.waiting());
      if (memory.hand_out && split_pair(team, batch, memory.pair, memory, descent.waiting()))
        return;
      whole = true;
    }
    descent.divide();
    floor = task_floor(memory, descent.waiting());
  }
  if (team.lane() == 0 && (!memory.is_task || end_task(batch, memory)))
    write_answer(batch.answers, memory.pair, world_sums(memory.place, memory.sum), memory.sum);
  team.sync();
}

}  // namespace ist::gpu
