#pragma once

#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/batch_arrays.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// Where a descent leaves what waits, if it fits.
struct SplitRoom {
  bool fits;
  std::uint32_t split;
  std::uint32_t first_entry;
  std::uint32_t first_task, tasks;  ///< taken, whether it fits or not
};

/// Takes room for the `waiting` entries of pair i and lists their tasks. All of the team together.
///
/// `floor_of(top)`: the lowest entry of the task that begins below entry `top`.
template <class Team, class FloorOf>
IST_HD SplitRoom take_room(const Team& team, const BatchArrays& batch, BatchCounters& counters,
                           std::uint32_t i, int waiting, const FloorOf& floor_of) {
  std::uint32_t tasks = 0;
  for (int top = waiting; top > 0; ++tasks) top = floor_of(top);
  const auto entries = static_cast<std::uint32_t>(waiting);
  std::uint32_t split = 0, task = 0, entry = 0, fits = 0, taken = 0;
  // Counters stop soon after the room ends, so that no batch is large enough to turn them over.
  if (team.lane() == 0 && atomic_load(&counters.splits) < batch.split_room &&
      atomic_load(&counters.tasks) < batch.task_room &&
      atomic_load(&counters.entries) < batch.entry_room) {
    taken = tasks;
    split = atomic_add(&counters.splits, 1);
    task = atomic_add(&counters.tasks, tasks);
    entry = atomic_add(&counters.entries, entries);
    const bool all = split < batch.split_room && task + tasks <= batch.task_room &&
                     entry + entries <= batch.entry_room;
    fits = all ? 1 : 0;
    // Room that was taken and does not do stays unused: its tasks hold nothing.
    int top = waiting;
    for (std::uint32_t k = 0; k < tasks; ++k) {
      const int floor = floor_of(top);
      if (task + k < batch.task_room)
        batch.tasks[task + k] = {split, entry + static_cast<std::uint32_t>(floor),
                                 all ? static_cast<std::uint32_t>(top - floor) : 0};
      top = floor;
    }
    if (all) batch.splits[split] = {i, task, tasks, tasks};
  }
  return {team.broadcast(fits, 0) != 0, team.broadcast(split, 0), team.broadcast(entry, 0),
          team.broadcast(task, 0), team.broadcast(taken, 0)};
}

}  // namespace ist::gpu
