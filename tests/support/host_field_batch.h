#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <ist/field.h>

#include "cuda/query/field_steps.h"
#include "cuda/query/make_field_ref.h"
#include "cuda/query/triangle_steps.h"
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
    rounds = 0;
    const gpu::FieldBatch batch = {fields_.data(),
                                   static_cast<std::uint32_t>(fields_.size()),
                                   assets_.refs().data(),
                                   static_cast<std::uint32_t>(assets_.refs().size()),
                                   measure,
                                   columns.pairs(),
                                   to.answers(),
                                   &counters,
                                   {lists[0].data(), lists[1].data()},
                                   room()};
    for (std::uint32_t i = 0; i < pairs.size(); ++i) {
      const int group = gpu::sift_field_pair(batch, i);
      if (group >= 0) gpu::listed_pair(batch, group, counters.listed[group]++) = i;
    }
    const auto memory = std::make_unique<gpu::WalkMemory>();
    for (std::uint32_t k = 0; k < counters.listed[gpu::kSmooth]; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_field_pair(team, batch, gpu::listed_pair(batch, gpu::kSmooth, k), *memory);
      });
    sum_rounds<gpu::FacetKind>(batch, seed);
    sum_rounds<gpu::MeshKind>(batch, seed);
    return to.rows();
  }

  gpu::FieldCounters counters;  ///< of the last run
  /// gpu::TriangleRoom
  std::uint32_t query_room = 7, part_room = 20, word_room = 3000, most_rounds = ~0u;
  std::uint32_t rounds = 0;  ///< of the last run

 private:
  gpu::TriangleRoom room() {
    queries_.resize(query_room);
    parts_.resize(part_room);
    words_.resize(word_room);
    return {queries_.data(), parts_.data(), words_.data(), query_room, part_room, word_room};
  }

  /// The kernels of triangle_kernels.cu.
  template <class Kind>
  void sum_rounds(const gpu::FieldBatch& batch, unsigned seed) {
    const auto walks = std::make_unique<typename Kind::WalkMemory>();
    const auto sums = std::make_unique<gpu::SumMemory<Kind>>();
    const auto whole = std::make_unique<gpu::WholeMemory<Kind>>();
    const std::uint32_t listed = counters.listed[Kind::kGroup];
    std::uint32_t first = 0;
    for (std::uint32_t n = 0; n < most_rounds && first < listed; ++n, ++rounds) {
      gpu::TriangleRound& round = gpu::round_of<Kind>(batch, n);
      round = {first, 0, 0, 0, 0};
      const std::uint32_t count = gpu::pairs_from<Kind>(batch, first);
      for (std::uint32_t k = 0; k < count; ++k) gpu::place_query<Kind>(batch, k, first + k);
      for (; round.walked < count && gpu::goes_on(batch, round, 1); ++round.walked)
        by_team(seed, [&](const auto& team) {
          gpu::walk_query<Kind>(team, batch, round, round.walked, *walks);
        });
      for (std::uint32_t k = 0; k < std::min(round.parts, part_room); ++k)
        by_team(seed, [&](const auto& team) { gpu::sum_part<Kind>(team, batch, k, *sums); });
      for (std::uint32_t k = 0; k < round.walked; ++k) gpu::answer_query(batch, k);
      if (round.walked == 0) throw std::logic_error("a round has no room for a pair");
      first = gpu::end_of<Kind>(batch, round);
    }
    const std::uint32_t large = counters.large[Kind::kGroup];
    for (std::uint32_t k = 0; k < large + (listed - first); ++k) {
      const std::uint32_t at = k < large ? k : first + (k - large);
      by_team(seed, [&](const auto& team) {
        gpu::sum_whole_query<Kind>(team, batch, gpu::listed_pair(batch, Kind::kGroup, at), *whole);
      });
    }
  }

  HostAssets assets_;
  std::vector<gpu::TriangleQuery> queries_;
  std::vector<gpu::MetPart> parts_;
  std::vector<std::uint32_t> words_;
  std::vector<gpu::FieldRef> fields_;
};

}  // namespace ist::testing
