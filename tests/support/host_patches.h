#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <ist/query.h>

#include "cuda/query/exact_arrays.h"
#include "support/batch_pair.h"
#include "support/host_solids.h"
#include "support/patch_columns.h"

namespace ist::testing {

/// The GPU's batch of contact patches on the host, as HostBatch runs penetrations.
class HostPatches {
 public:
  explicit HostPatches(HostSolids solids) : solids_(std::move(solids)) {}

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<PatchedPair> run(const std::vector<BatchPair>& pairs, Measure measure,
                               std::uint32_t most, unsigned seed = 0);

  // For Measure::exact:
  gpu::ExactCounters exact_counters;  ///< of the last run
  /// [bytes] of a pass's memory for parts, at most.
  std::ptrdiff_t part_bytes[gpu::kExactPasses] = {0, PTRDIFF_MAX, PTRDIFF_MAX};

 private:
  void divide_exactly(const gpu::SolidPairs& asked, const GpuContactPatches& patches,
                      unsigned seed);

  HostSolids solids_;
};

}  // namespace ist::testing
