#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <ist/gpu_query.h>

#include "cuda/query/cover_ref.h"
#include "cuda/query/cuts_ref.h"
#include "cuda/query/detail_ref.h"
#include "cuda/query/node_sums.h"
#include "cuda/query/pair_descent.h"

namespace ist::gpu {

/// An asset as a batch finds it.
struct AssetRef {
  AssetFrame frame;
  TreeRef tree[2];  ///< by Measure
  SumsRef sums[2];  ///< set_sums()
  CutsRef cuts[2];  ///< by Measure
  CoverRef cover;   ///< of the inner tree
  AssetDetails details;

  /// `bytes`: where the asset lies for who works on the batch.
  static AssetRef of(const AssetHeader& header, const std::byte* bytes) {
    AssetRef ref = {};
    ref.frame = {{header.centre[0], header.centre[1], header.centre[2]},
                 std::ldexp(1.0, header.exponent)};
    ref.tree[static_cast<int>(Measure::matched)] = TreeRef::of(header.matched_tree, bytes);
    ref.tree[static_cast<int>(Measure::inner)] = TreeRef::of(header.inner_tree, bytes);
    ref.cover = CoverRef::of(header.inner_tree, bytes);
    return ref;
  }

  /// `nodes`: node_sums() of the matched tree and of the inner one, one after the other.
  void set_sums(const AssetHeader& header, const NodeSum* nodes) {
    sums[static_cast<int>(Measure::matched)] = SumsRef::of(header.matched_tree, nodes);
    sums[static_cast<int>(Measure::inner)] =
        SumsRef::of(header.inner_tree, nodes + node_count(header.matched_tree));
  }
};

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

/// A batch in the memory of who works on it: kernels, or a test on the host.
struct BatchArrays {
  const AssetRef* assets;
  std::uint32_t asset_count;
  Measure measure;
  std::uint32_t pair_budget;  ///< 0: none
  bool has_details;           ///< some asset has coarser levels
  GpuPairs pairs;
  GpuPenetrations answers;

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
