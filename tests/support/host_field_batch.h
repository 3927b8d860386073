#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include <ist/field.h>

#include "cuda/query/field_steps.h"
#include "cuda/query/make_field_ref.h"
#include "support/host_batch.h"

namespace ist::testing {

/// A batch of fields and trees of the GPU's on the host, as HostBatch is one of trees.
class HostFieldBatch {
 public:
  HostFieldBatch(const std::vector<TreeView>& assets, const std::vector<Field>& fields)
      : assets_(assets) {
    for (const Field& field : fields)
      fields_.push_back(gpu::field_ref(field, gpu::pointed_to(field).data()));
  }
  HostFieldBatch(const std::vector<TreeView>& assets, std::vector<gpu::FieldRef> fields)
      : assets_(assets), fields_(std::move(fields)) {}

  /// `pairs`: a of each names a field. `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Penetration> run(const std::vector<BatchPair>& pairs, Measure measure,
                               unsigned seed = 0) {
    const PairColumns columns(pairs);
    BatchColumns to = BatchColumns::unwritten(pairs.size());
    std::vector<std::uint32_t> lists[2] = {std::vector<std::uint32_t>(pairs.size()),
                                           std::vector<std::uint32_t>(pairs.size())};
    counters = {};
    const gpu::FieldBatch batch = {fields_.data(),
                                   static_cast<std::uint32_t>(fields_.size()),
                                   assets_.refs().data(),
                                   static_cast<std::uint32_t>(assets_.refs().size()),
                                   measure,
                                   columns.pairs(),
                                   to.answers(),
                                   &counters,
                                   {lists[0].data(), lists[1].data()}};
    for (std::uint32_t i = 0; i < pairs.size(); ++i) {
      const int group = gpu::sift_field_pair(batch, i);
      if (group >= 0) gpu::listed_pair(batch, group, counters.listed[group]++) = i;
    }
    sum<gpu::WalkMemory>(batch, gpu::kSmooth, seed);
    sum<gpu::FacetMemory>(batch, gpu::kFacets, seed);
    sum<gpu::SurfaceMemory>(batch, gpu::kMesh, seed);
    return to.rows();
  }

  gpu::FieldCounters counters;  ///< of the last run

 private:
  template <class Memory>
  void sum(const gpu::FieldBatch& batch, gpu::FieldGroup group, unsigned seed) {
    const auto memory = std::make_unique<Memory>();
    for (std::uint32_t k = 0; k < counters.listed[group]; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_field_pair(team, batch, gpu::listed_pair(batch, group, k), *memory);
      });
  }

  HostAssets assets_;
  std::vector<gpu::FieldRef> fields_;
};

}  // namespace ist::testing
