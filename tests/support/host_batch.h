#pragma once

#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_steps.h"
#include "support/batch_pair.h"
#include "support/host_team.h"
#include "support/pair_columns.h"

namespace ist::testing {

/// A batch of the GPU's on the host: what its kernels do, by a team of one or, lane by lane, by one
/// of 32.
class HostBatch {
 public:
  /// Room for what is split: so many of each kind.
  explicit HostBatch(std::vector<TreeView> assets, std::uint32_t room = 1 << 16) : room_(room) {
    for (const TreeView& asset : assets) {
      const AssetHeader& header = asset.header();
      assets_.push_back(gpu::AssetRef::of(header, reinterpret_cast<const std::byte*>(&header)));
    }
  }

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Penetration> run(const std::vector<BatchPair>& pairs, Measure measure,
                               unsigned seed = 0) {
    const std::size_t n = pairs.size();
    const PairColumns columns(pairs);
    constexpr double kUnwritten = -7;
    BatchColumns to{std::vector<double>(n, kUnwritten), std::vector<double>(3 * n),
                    std::vector<double>(3 * n),         std::vector<double>(3 * n),
                    std::vector<QueryStatus>(n),        std::vector<std::uint32_t>(n),
                    std::vector<std::uint32_t>(n)};
    std::vector<std::uint32_t> lists[2] = {std::vector<std::uint32_t>(n),
                                           std::vector<std::uint32_t>(n)};
    std::vector<gpu::SplitPair> splits(room_);
    std::vector<gpu::PairTask> tasks(room_);
    std::vector<gpu::LensTotals> totals(2 * std::size_t{room_});
    std::vector<std::uint32_t> entries_a(room_), entries_b(room_);
    counters = {};
    const gpu::BatchArrays batch = {
        assets_.data(),
        static_cast<std::uint32_t>(assets_.size()),
        measure,
        columns.pairs(),
        {to.volume.data(), to.centroid.data(), to.push.data(), to.turn.data(), to.status.data(),
         to.visits.data(), to.spheres.data()},
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
      if (list >= 0) lists[list][counters.listed[list]++] = i;
    }
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

  std::vector<gpu::AssetRef> assets_;
  std::uint32_t room_;
};

}  // namespace ist::testing
