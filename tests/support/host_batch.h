#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_steps.h"
#include "cuda/query/detail_sums.h"
#include "support/batch_pair.h"
#include "support/host_assets.h"
#include "support/host_team.h"

namespace ist::testing {

/// A batch of the GPU's on the host: what its kernels do, by a team of one or, lane by lane, by one
/// of 32.
class HostBatch {
 public:
  /// Room for what is split: so many of each kind.
  explicit HostBatch(const std::vector<TreeView>& assets, std::uint32_t room = 1 << 16)
      : assets_(assets), room_(room) {
    cut_for(1);
  }

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Penetration> run(const std::vector<BatchPair>& pairs, Measure measure,
                               unsigned seed = 0, std::uint32_t pair_budget = 0) {
    const std::size_t n = pairs.size();
    const PairColumns columns(pairs);
    BatchColumns to = BatchColumns::unwritten(n);
    std::vector<std::uint32_t> list(gpu::kSizes * n), detailed(n);
    std::vector<gpu::SplitPair> splits(room_);
    std::vector<gpu::PairTask> tasks(room_);
    std::vector<std::uint32_t> posted(room_);
    std::vector<gpu::PairPlace> places(room_);
    std::vector<gpu::LensTotals> totals(2 * std::size_t{room_});
    std::vector<std::uint32_t> entries_a(room_), entries_b(room_);
    counters = {};
    const gpu::BatchArrays batch = {assets_.refs().data(),
                                    static_cast<std::uint32_t>(assets_.refs().size()),
                                    measure,
                                    pair_budget,
                                    true,
                                    columns.pairs(),
                                    to.answers(),
                                    &counters,
                                    list.data(),
                                    detailed.data(),
                                    splits.data(),
                                    tasks.data(),
                                    posted.data(),
                                    places.data(),
                                    totals.data(),
                                    entries_a.data(),
                                    entries_b.data(),
                                    room_,
                                    room_,
                                    room_,
                                    most_alone,
                                    task_weight,
                                    by_size ? static_cast<std::uint32_t>(n) : 0};
    for (std::uint32_t i = 0; i < n; ++i) {
      std::uint32_t meet = 0;
      const gpu::PairUse use = gpu::sift_pair(batch, i, meet);
      if (use == gpu::PairUse::summed) gpu::list_pair(batch, i, meet, counters.listed++);
      if (use == gpu::PairUse::detailed) detailed[counters.detailed++] = i;
    }
    const auto details = std::make_unique<gpu::DetailMemory>();
    for (std::uint32_t k = 0; k < counters.detailed; ++k)
      by_team(seed,
              [&](const auto& team) { gpu::sum_details(team, batch, detailed[k], *details); });
    sum(batch, seed);
    for (const std::uint32_t flag : posted)
      if (flag != 0) throw std::logic_error("a task was not taken");
    return to.rows();
  }

  gpu::BatchCounters counters;  ///< of the last run
  std::uint32_t most_alone = 0, task_weight = 0;
  bool by_size = true;

  /// How pairs are cut up in a workspace for so many; for few at first.
  void cut_for(std::size_t most_pairs) {
    gpu::BatchArrays arrays;
    arrays.cut_for(most_pairs);
    most_alone = arrays.most_alone;
    task_weight = arrays.task_weight;
    by_size = arrays.size_room > 0;
  }

 private:
  void sum(const gpu::BatchArrays& batch, unsigned seed) {
    const auto memory = std::make_unique<gpu::WorkMemory>();
    memory->is_task = false;
    constexpr std::uint32_t kMost = 1 + gpu::kPlacedAhead;
    for (std::uint32_t k = 0; k < counters.listed; k += kMost)
      by_team(seed, [&](const auto& team) {
        gpu::place_pairs(team, batch, k, std::min(kMost, counters.listed - k), *memory);
        for (;;) {
          if (team.lane() == 0) memory->hand_out = memory->at % 4 != 0;
          gpu::do_work(team, batch, *memory);
          if (memory->waiting == 0) return;
          team.sync();
          gpu::take_placed(team, *memory);
        }
      });
    memory->is_task = true;
    for (std::uint32_t k = 0; gpu::look_for_task(batch, k, 0) != 0; ++k) {
      memory->at = k;
      by_team(seed, [&](const auto& team) {
        if (gpu::take_task(team, batch, *memory)) gpu::do_work(team, batch, *memory);
      });
    }
  }

  HostAssets assets_;
  std::uint32_t room_;
};

}  // namespace ist::testing
