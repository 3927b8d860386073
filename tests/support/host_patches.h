#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <ist/query.h>

#include "cuda/query/patch_steps.h"
#include "support/batch_pair.h"
#include "support/host_solids.h"
#include "support/host_team.h"
#include "support/patch_columns.h"

namespace ist::testing {

/// The GPU's batch of contact patches on the host, as HostBatch runs penetrations.
class HostPatches {
 public:
  explicit HostPatches(HostSolids solids) : solids_(std::move(solids)) {}

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<PatchedPair> run(const std::vector<BatchPair>& pairs, Measure measure,
                               std::uint32_t most, unsigned seed = 0) {
    const std::size_t n = pairs.size();
    const PairColumns columns(pairs);
    BatchColumns wholes = BatchColumns::unwritten(n);
    constexpr double kUnwritten = -7;
    const std::vector<double> numbers(n * most, kUnwritten), vectors(3 * n * most, kUnwritten);
    PatchColumns to{most,
                    std::vector<std::uint32_t>(n, 99),
                    std::vector<std::uint64_t>(n * most),
                    vectors,
                    vectors,
                    numbers,
                    numbers,
                    numbers,
                    vectors,
                    vectors,
                    vectors,
                    numbers};
    // What teams that come before left in their room must not matter.
    std::vector<std::byte> room(gpu::PatchRoom::bytes(solids_.most_bins()), std::byte{0xA5});
    gpu::PatchArrays batch = {};
    static_cast<gpu::SolidPairs&>(batch.pairs) =
        solids_.asked(columns.pairs(), measure, wholes.answers());
    batch.patches = {most,
                     to.count.data(),
                     to.id.data(),
                     to.centroid.data(),
                     to.normal.data(),
                     to.area.data(),
                     to.depth.data(),
                     to.volume.data(),
                     to.force.data(),
                     to.torque.data(),
                     to.point.data(),
                     to.twist.data()};
    batch.rooms = room.data();
    batch.most_bins = solids_.most_bins();
    const auto memory = std::make_unique<gpu::PatchMemory>();
    for (std::uint32_t i = 0; i < n; ++i)
      if (gpu::sift_patches(batch, i))
        by_team(seed,
                [&](const auto& team) { gpu::patch_pair(team, batch, i, batch.room(0), *memory); });
    return to.rows(wholes.rows());
  }

 private:
  HostSolids solids_;
};

}  // namespace ist::testing
