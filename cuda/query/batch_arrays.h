#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/pair_descent.h"
#include "cuda/query/solid_ref.h"

namespace ist::gpu {

/// What a descent left waiting, cut into tasks for whoever has time.
struct SplitPair {
  std::uint32_t pair;        ///< of the batch
  std::uint32_t first_task;  ///< whose totals follow those of the descent itself
  std::uint32_t tasks;
  std::uint32_t left;  ///< tasks that are not done
};

struct PairTask {
  std::uint32_t split;
  std::uint32_t first, count;  ///< entries
};

/// Sizes of pairs that are told apart: by how many pairs of their roots' children meet, within a
/// factor of two, the largest first.
constexpr std::uint32_t kSizes = 9;
static_assert(1u << (kSizes - 1) == kWidth * kWidth);

/// Counters of a batch: zero at first.
struct BatchCounters {
  std::uint32_t listed;           ///< pairs whose roots meet
  std::uint32_t of_size[kSizes];  ///< of them, where they are listed by size
  std::uint32_t taken;
  std::uint32_t splits, tasks, entries, tasks_taken;
  std::uint32_t handed_out;               ///< pairs that may have left tasks, and leave no more
  std::uint32_t detailed, details_taken;  ///< pairs that are asked at several levels of detail
};

/// A batch as it was asked, in the memory of who works on it: kernels, or a test on the host. Of
/// penetrations and patches; of separations all but `answers`.
struct SolidPairs {
  const SolidRef* solids;
  std::uint32_t solid_count;
  Measure measure;
  GpuPairs pairs;
  GpuPenetrations answers;
};

/// Its pairs of trees, and what these are worked on in.
struct BatchArrays : SolidPairs {
  std::uint32_t pair_budget;  ///< 0: none
  bool has_details;           ///< some asset has coarser levels

  BatchCounters* counters;
  std::uint32_t* list;      ///< room for all pairs, and of few for all in every size
  std::uint32_t* detailed;  ///< likewise
  // Room for what is split; what finds none is summed by the team that met it.
  SplitPair* splits;
  PairTask* tasks;
  std::uint32_t* posted;  ///< [task_room] 1: the task can be taken; 0 before a batch and after it
  PairPlace* places;      ///< [split_room]
  LensTotals* totals;     ///< of splits[0]: [split_room + task_room]
  std::uint32_t* entries_a;
  std::uint32_t* entries_b;
  std::uint32_t split_room, task_room, entry_room;
  std::uint32_t most_alone;   ///< pairs of leaves that a descent meets before it is split
  std::uint32_t task_weight;  ///< the least of a task, as task_floor() counts
  std::uint32_t size_room;    ///< pairs in the list of a size; 0: one list for all

  /// How finely pairs are cut: where a batch is of few, for all warps to have work until its end;
  /// where it is of many, as seldom as can be, since each cut costs. Of few the largest begin.
  void cut_for(std::size_t most_pairs) {
    const bool few = most_pairs <= kFewGpuPairs;
    most_alone = few ? 80 : 512;
    task_weight = few ? 24 : 64;
    size_room = few ? static_cast<std::uint32_t>(most_pairs) : 0;
  }
};

}  // namespace ist::gpu
