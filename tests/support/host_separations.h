#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include <ist/query.h>

#include "cuda/query/separation_steps.h"
#include "support/batch_pair.h"
#include "support/host_solids.h"
#include "support/host_team.h"
#include "support/separation_columns.h"

namespace ist::testing {

/// The GPU's batch of separations on the host, as HostBatch runs penetrations.
class HostSeparations {
 public:
  /// Room for what is split: so many of each kind.
  explicit HostSeparations(HostSolids solids, std::uint32_t room = 1 << 16)
      : solids_(std::move(solids)), room_(room) {}

  /// `seed`: of the order in which lanes go on; 0: a team of one. `max_visits`: 0: no limit.
  std::vector<Separation> run(const std::vector<BatchPair>& pairs, unsigned seed = 0,
                              std::uint32_t max_visits = 0) {
    const std::size_t n = pairs.size();
    const PairColumns columns(pairs);
    constexpr double kUnwritten = -7;
    const std::vector<double> numbers(n, kUnwritten), vectors(3 * n, kUnwritten);
    SeparationColumns to{numbers,
                         numbers,
                         numbers,
                         vectors,
                         vectors,
                         vectors,
                         std::vector<QueryStatus>(n),
                         std::vector<std::uint32_t>(n),
                         std::vector<std::uint32_t>(n)};
    std::vector<std::uint32_t> lists[2] = {std::vector<std::uint32_t>(n),
                                           std::vector<std::uint32_t>(n)};
    std::vector<gpu::SplitPair> splits(room_);
    std::vector<gpu::PairTask> tasks(room_);
    std::vector<gpu::GapTotals> totals(2 * std::size_t{room_});
    std::vector<std::uint32_t> entries_a(room_), entries_b(room_);
    std::vector<double> entries_gap(room_), entries_cover(room_);
    counters[0] = counters[1] = {};
    gpu::SeparationArrays batch = {};
    static_cast<gpu::SolidPairs&>(batch.pairs) = solids_.asked(columns.pairs(), Measure::inner, {});
    batch.counters = counters;
    for (int kind = 0; kind < 2; ++kind) batch.list[kind] = lists[kind].data();
    batch.pairs.splits = splits.data();
    batch.pairs.tasks = tasks.data();
    batch.pairs.split_room = batch.pairs.task_room = batch.pairs.entry_room = room_;
    batch.answers = {to.distance.data(), to.distance_min.data(), to.distance_max.data(),
                     to.point_a.data(),  to.point_b.data(),      to.normal.data(),
                     to.status.data(),   to.visits.data(),       to.spheres.data()};
    batch.max_visits = max_visits == 0 ? ~0u : max_visits;
    batch.totals = totals.data();
    batch.entries = {entries_a.data(), entries_b.data(), entries_gap.data(), entries_cover.data()};
    for (std::uint32_t i = 0; i < n; ++i) {
      const int list = gpu::sift_separation(batch, i);
      if (list >= 0) lists[list][counters[list].listed++] = i;
    }
    separate<float>(batch, 0, seed);
    separate<double>(batch, 1, seed);
    return to.rows();
  }

  gpu::BatchCounters counters[2];  ///< of the last run, by kind

 private:
  template <class Real>
  void separate(const gpu::SeparationArrays& batch, int kind, unsigned seed) {
    const auto memory = std::make_unique<gpu::GapMemory<Real>>();
    for (std::uint32_t k = 0; k < counters[kind].listed; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::separate_pair<std::decay_t<decltype(team)>, Real>(team, batch, batch.list[kind][k],
                                                               *memory);
      });
    for (std::uint32_t k = 0; k < std::min(counters[kind].tasks, room_); ++k)
      by_team(seed, [&](const auto& team) {
        gpu::separate_task<std::decay_t<decltype(team)>, Real>(team, batch, k, *memory);
      });
  }

  HostSolids solids_;
  std::uint32_t room_;
};

}  // namespace ist::testing
