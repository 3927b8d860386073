#pragma once

#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_steps.h"
#include "cuda/query/detail_sums.h"
#include "numerics/team.h"
#include "support/batch_pair.h"
#include "support/host_assets.h"

namespace ist::testing {

/// A batch of the GPU's on the host: what its kernels do, by a team of one or, lane by lane, by one
/// of 32.
class HostBatch {
 public:
  /// Room for what is split: so many of each kind.
  explicit HostBatch(const std::vector<TreeView>& assets, std::uint32_t room = 1 << 16)
      : assets_(assets), room_(room) {}

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Penetration> run(const std::vector<BatchPair>& pairs, Measure measure,
                               unsigned seed = 0, std::uint32_t pair_budget = 0) {
    const std::size_t n = pairs.size();
    const PairColumns columns(pairs);
    BatchColumns to = BatchColumns::unwritten(n);
    std::vector<std::uint32_t> lists[2] = {std::vector<std::uint32_t>(n),
                                           std::vector<std::uint32_t>(n)};
    std::vector<gpu::SplitPair> splits(room_);
    std::vector<gpu::PairTask> tasks(room_);
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
                                    {lists[0].data(), lists[1].data()},
                                    splits.data(),
                                    tasks.data(),
                                    totals.data(),
                                    entries_a.data(),
                                    entries_b.data(),
                                    room_,
                                    room_,
                                    room_};
    for (std::uint32_t i = 0; i < n; ++i) {
      const int list = gpu::sift_pair(batch, i);
      if (list == gpu::kDetailed)
        gpu::detailed_pair(batch, counters.detailed++) = i;
      else if (list >= 0)
        lists[list][counters.listed[list]++] = i;
    }
    const auto details = std::make_unique<gpu::DetailMemory>();
    for (std::uint32_t k = 0; k < counters.detailed; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_details(team, batch, gpu::detailed_pair(batch, k), *details);
      });
    sum<float>(batch, 0, seed);
    sum<double>(batch, 1, seed);
    return to.rows();
  }

  gpu::BatchCounters counters;  ///< of the last run

 private:
  template <class Real>
  void sum(const gpu::BatchArrays& batch, int kind, unsigned seed) {
    const auto memory = std::make_unique<gpu::PairMemory<Real>>();
    for (std::uint32_t k = 0; k < counters.listed[kind]; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_pair<std::decay_t<decltype(team)>, Real>(team, batch, batch.list[kind][k],
                                                          *memory);
      });
    for (std::uint32_t k = 0; k < std::min(counters.tasks[kind], room_); ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_task<std::decay_t<decltype(team)>, Real>(team, batch, k, *memory);
      });
  }

  HostAssets assets_;
  std::uint32_t room_;
};

}  // namespace ist::testing
