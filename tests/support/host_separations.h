#pragma once

#include <utility>
#include <vector>

#include <ist/query.h>

#include "cuda/query/separation_arrays.h"
#include "support/batch_pair.h"
#include "support/host_solids.h"

namespace ist::testing {

/// The GPU's batch of separations on the host, as HostBatch runs penetrations.
class HostSeparations {
 public:
  /// The capacity for split pairs, by kind.
  explicit HostSeparations(HostSolids solids, std::uint32_t capacity = 1 << 16)
      : solids_(std::move(solids)), capacity_(capacity) {}

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Separation> run(const std::vector<BatchPair>& pairs, unsigned seed = 0,
                              const GpuSeparationSettings& settings = {});

  gpu::BatchCounters counters[3];    ///< of the last run, by kind
  std::uint32_t mesh_capacity = 50;  ///< pairs of meshes of a round

 private:
  template <class Real>
  void separate(const gpu::SeparationArrays& batch, int kind, unsigned seed);
  void separate_meshes(gpu::SeparationArrays& batch, unsigned seed);

  HostSolids solids_;
  std::uint32_t capacity_;
};

}  // namespace ist::testing
