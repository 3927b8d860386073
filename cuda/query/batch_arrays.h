#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/pair_descent.h"
#include "cuda/query/solid_ref.h"

namespace ist::gpu {

/// The pending node pairs of a traversal, split into tasks for idle teams.
struct SplitPair {
  std::uint32_t pair;        ///< in the batch
  std::uint32_t first_task;  ///< whose totals follow those of the descent itself
  std::uint32_t tasks;
  std::uint32_t left;  ///< tasks that are not done
};

struct PairTask {
  std::uint32_t split;
  std::uint32_t first, count;  ///< entries
};

/// The number of size classes of pairs. A class is the number of intersecting pairs of the roots'
/// children, within a factor of two, the largest first.
constexpr std::uint32_t kSizes = 9;
static_assert(1u << (kSizes - 1) == kWidth * kWidth);

/// The counters of a batch, initially zero.
struct BatchCounters {
  std::uint32_t listed;           ///< pairs whose roots meet
  std::uint32_t of_size[kSizes];  ///< the same by size class
  std::uint32_t taken;
  std::uint32_t splits, tasks, entries, tasks_taken;
  std::uint32_t handed_out;               ///< pairs that may have left tasks, and leave no more
  std::uint32_t detailed, details_taken;  ///< pairs that need several levels of detail
};

/// The input and output of a batch, in memory of the device, or of the host in tests. Separations
/// do not use `answers`.
struct SolidPairs {
  const SolidRef* solids;
  std::uint32_t solid_count;
  Measure measure;
  GpuPairs pairs;
  GpuPenetrations answers;
};

/// A batch of pairs of trees, and its working memory.
struct BatchArrays : SolidPairs {
  std::uint32_t pair_budget;  ///< 0: none
  bool has_details;           ///< some asset has coarser levels

  BatchCounters* counters;
  std::uint32_t* list;      ///< holds all pairs; in a small batch all pairs for every size class
  std::uint32_t* detailed;  ///< likewise
  // Memory for split pairs. A team that finds it full sums its pair alone.
  SplitPair* splits;
  PairTask* tasks;
  std::uint32_t*
      posted;          ///< [task_capacity] 1: the task can be taken; 0 before a batch and after it
  PairPlace* places;   ///< [split_capacity]
  LensTotals* totals;  ///< [split_capacity + task_capacity]
  std::uint32_t* entries_a;
  std::uint32_t* entries_b;
  std::uint32_t split_capacity, task_capacity, entry_capacity;
  std::uint32_t most_alone;     ///< pairs of leaves that a descent meets before it is split
  std::uint32_t task_weight;    ///< the minimum of a task, as task_floor() counts
  std::uint32_t size_capacity;  ///< pairs in the list of a size; 0: one list for all

  /// Chooses how finely pairs are split. A small batch is split so that all warps have work until
  /// the end, and its largest pairs start first. A large batch is split as rarely as possible,
  /// since each split costs.
  void cut_for(std::size_t most_pairs) {
    const bool few = most_pairs <= kFewGpuPairs;
    most_alone = few ? 80 : 512;
    task_weight = few ? 24 : 64;
    size_capacity = few ? static_cast<std::uint32_t>(most_pairs) : 0;
  }
};

}  // namespace ist::gpu
