#pragma once

#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_steps.h"
#include "numerics/team.h"
#include "support/batch_pair.h"
#include "support/fiber_team.h"

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
    std::vector<std::uint32_t> a, b;
    std::vector<Pose> pose_a, pose_b;
    std::vector<double> scale_a, scale_b;
    for (const BatchPair& pair : pairs) {
      a.push_back(pair.a);
      b.push_back(pair.b);
      pose_a.push_back(pair.pose_a);
      pose_b.push_back(pair.pose_b);
      scale_a.push_back(pair.scale_a);
      scale_b.push_back(pair.scale_b);
    }
    constexpr double kUnwritten = -7;
    BatchColumns to{std::vector<double>(n, kUnwritten), std::vector<double>(3 * n),
                    std::vector<double>(3 * n),         std::vector<double>(3 * n),
                    std::vector<QueryStatus>(n),        std::vector<std::uint32_t>(n),
                    std::vector<std::uint32_t>(n)};
    std::vector<std::uint32_t> list(n);
    std::vector<gpu::SplitPair> splits(room_);
    std::vector<gpu::PairTask> tasks(room_);
    std::vector<gpu::PairPlace> places(room_);
    std::vector<gpu::LensTotals> totals(2 * std::size_t{room_});
    std::vector<std::uint32_t> entries_a(room_), entries_b(room_);
    counters = {};
    const gpu::BatchArrays batch = {
        assets_.data(),
        static_cast<std::uint32_t>(assets_.size()),
        measure,
        {n, a.data(), b.data(), pose_a.data(), pose_b.data(), scale_a.data(), scale_b.data()},
        {to.volume.data(), to.centroid.data(), to.push.data(), to.turn.data(), to.status.data(),
         to.visits.data(), to.spheres.data()},
        &counters,
        list.data(),
        splits.data(),
        tasks.data(),
        places.data(),
        totals.data(),
        entries_a.data(),
        entries_b.data(),
        room_,
        room_,
        room_,
        most_alone,
        task_weight};
    for (std::uint32_t i = 0; i < n; ++i)
      if (gpu::sift_pair(batch, i)) list[counters.listed++] = i;
    sum(batch, seed);
    return to.rows();
  }

  gpu::BatchCounters counters;  ///< of the last run
  std::uint32_t most_alone = gpu::BatchArrays().most_alone;
  std::uint32_t task_weight = gpu::BatchArrays().task_weight;

 private:
  void sum(const gpu::BatchArrays& batch, unsigned seed) {
    const auto memory = std::make_unique<gpu::PairMemory>();
    for (std::uint32_t k = 0; k < counters.listed; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_pair(team, batch, batch.list[k], k % 3 != 0, *memory);
      });
    for (std::uint32_t k = 0; k < std::min(counters.tasks, room_); ++k)
      by_team(seed, [&](const auto& team) { gpu::sum_task(team, batch, k, *memory); });
  }

  template <class Work>
  static void by_team(unsigned seed, const Work& work) {
    if (seed == 0) {
      work(SerialTeam());
      return;
    }
    static Fibers<32> fibers(seed);
    fibers.run([&](int lane) { work(FiberTeam<32>(fibers, lane)); });
  }

  std::vector<gpu::AssetRef> assets_;
  std::uint32_t room_;
};

}  // namespace ist::testing
