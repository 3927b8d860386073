#pragma once

#include <utility>
#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/exact_arrays.h"
#include "cuda/query/field_batch.h"
#include "support/batch_pair.h"
#include "support/host_solids.h"

namespace ist::testing {

/// A batch of the GPU's on the host: what its kernels do, by a team of one or, lane by lane, by one
/// of 32.
class HostBatch {
 public:
  /// The capacity for split pairs, by kind.
  explicit HostBatch(HostSolids solids, std::uint32_t capacity = 1 << 16)
      : solids_(std::move(solids)), capacity_(capacity) {
    cut_for(1);
  }

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Penetration> run(const std::vector<BatchPair>& pairs, Measure measure,
                               unsigned seed = 0, std::uint32_t pair_budget = 0);

  gpu::BatchCounters counters;        ///< of the last run
  gpu::ExactCounters exact_counters;  ///< of the last exact one
  std::uint32_t most_alone = 0, task_weight = 0;
  bool by_size = true;
  // For pairs of a tree and a field.
  gpu::FieldCounters field_counters;  ///< of the last run
  std::uint32_t query_capacity = 7, part_capacity = 20,
                word_capacity = 3000;  ///< gpu::TriangleWorkspace
  // For pairs of meshes: pairs of a round, chunks of triangles.
  std::uint32_t mesh_capacity = 50, mesh_chunks = 400;
  std::uint32_t most_rounds = ~0u;
  std::uint32_t rounds = 0;  ///< of the last run
  // State that exact runs keep for the next: see GpuKept.
  std::uint32_t held = 0, fresh = 0;  ///< of the last run: pairs not searched; searched and kept

  /// From now on, keeps the state of at most so many pairs.
  void keep(std::uint32_t most_pairs, std::uint32_t bytes_each);

  /// How pairs are cut up in a workspace for so many; for few at first.
  void cut_for(std::size_t most_pairs);

 private:
  void sum(const gpu::BatchArrays& batch, unsigned seed);
  void run_exactly(const gpu::SolidPairs& asked, unsigned seed);
  void run_fields(const gpu::SolidPairs& asked, unsigned seed);
  gpu::TriangleWorkspace triangle_work();
  /// The kernels of field_kernels.cu.
  void sum_rounds(const gpu::FieldBatch& batch, unsigned seed);

  HostSolids solids_;
  std::uint32_t capacity_;
  std::vector<gpu::TriangleQuery> queries_;
  std::vector<gpu::MetPart> parts_;
  std::vector<std::uint32_t> words_;
  std::vector<std::uint64_t> kept_memory_;
  gpu::ExactKept kept_ = {};  ///< of no pairs: nothing is kept
};

}  // namespace ist::testing
