#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_steps.h"
#include "cuda/query/detail_sums.h"
#include "cuda/query/field_steps.h"
#include "cuda/query/triangle_steps.h"
#include "support/batch_pair.h"
#include "support/host_solids.h"
#include "support/host_team.h"

namespace ist::testing {

/// A batch of the GPU's on the host: what its kernels do, by a team of one or, lane by lane, by one
/// of 32.
class HostBatch {
 public:
  /// Room for what is split: so many of each kind.
  explicit HostBatch(HostSolids solids, std::uint32_t room = 1 << 16)
      : solids_(std::move(solids)), room_(room) {
    cut_for(1);
  }

  /// `seed`: of the order in which lanes go on; 0: a team of one.
  std::vector<Penetration> run(const std::vector<BatchPair>& pairs, Measure measure,
                               unsigned seed = 0, std::uint32_t pair_budget = 0) {
    const std::size_t n = pairs.size();
    const PairColumns columns(pairs);
    BatchColumns to = BatchColumns::unwritten(n);
    std::vector<std::uint32_t> list(gpu::kSizes * n), detailed(n);
    std::vector<gpu::SplitPair> splits(room_);
    std::vector<gpu::PairTask> tasks(room_);
    std::vector<std::uint32_t> posted(room_);
    std::vector<gpu::PairPlace> places(room_);
    std::vector<gpu::LensTotals> totals(2 * std::size_t{room_});
    std::vector<std::uint32_t> entries_a(room_), entries_b(room_);
    counters = {};
    const gpu::SolidPairs asked = solids_.asked(columns.pairs(), measure, to.answers());
    const gpu::BatchArrays batch = {asked,
                                    pair_budget,
                                    true,
                                    &counters,
                                    list.data(),
                                    detailed.data(),
                                    splits.data(),
                                    tasks.data(),
                                    posted.data(),
                                    places.data(),
                                    totals.data(),
                                    entries_a.data(),
                                    entries_b.data(),
                                    room_,
                                    room_,
                                    room_,
                                    most_alone,
                                    task_weight,
                                    by_size ? static_cast<std::uint32_t>(n) : 0};
    for (std::uint32_t i = 0; i < n; ++i) {
      std::uint32_t meet = 0;
      const gpu::PairUse use = gpu::sift_pair(batch, i, meet);
      if (use == gpu::PairUse::summed) gpu::list_pair(batch, i, meet, counters.listed++);
      if (use == gpu::PairUse::detailed) detailed[counters.detailed++] = i;
    }
    const auto details = std::make_unique<gpu::DetailMemory>();
    for (std::uint32_t k = 0; k < counters.detailed; ++k)
      by_team(seed,
              [&](const auto& team) { gpu::sum_details(team, batch, detailed[k], *details); });
    sum(batch, seed);
    for (const std::uint32_t flag : posted)
      if (flag != 0) throw std::logic_error("a task was not taken");
    run_fields(asked, seed);
    return to.rows();
  }

  gpu::BatchCounters counters;  ///< of the last run
  std::uint32_t most_alone = 0, task_weight = 0;
  bool by_size = true;
  // Of pairs of a tree and a field.
  gpu::FieldCounters field_counters;                               ///< of the last run
  std::uint32_t query_room = 7, part_room = 20, word_room = 3000;  ///< gpu::TriangleRoom
  std::uint32_t most_rounds = ~0u;
  std::uint32_t rounds = 0;  ///< of the last run

  /// How pairs are cut up in a workspace for so many; for few at first.
  void cut_for(std::size_t most_pairs) {
    gpu::BatchArrays arrays;
    arrays.cut_for(most_pairs);
    most_alone = arrays.most_alone;
    task_weight = arrays.task_weight;
    by_size = arrays.size_room > 0;
  }

 private:
  void sum(const gpu::BatchArrays& batch, unsigned seed) {
    const auto memory = std::make_unique<gpu::WorkMemory>();
    memory->is_task = false;
    constexpr std::uint32_t kMost = 1 + gpu::kPlacedAhead;
    for (std::uint32_t k = 0; k < counters.listed; k += kMost)
      by_team(seed, [&](const auto& team) {
        gpu::place_pairs(team, batch, k, std::min(kMost, counters.listed - k), *memory);
        for (;;) {
          if (team.lane() == 0) memory->hand_out = memory->at % 4 != 0;
          gpu::do_work(team, batch, *memory);
          if (memory->waiting == 0) return;
          team.sync();
          gpu::take_placed(team, *memory);
        }
      });
    memory->is_task = true;
    for (std::uint32_t k = 0; gpu::look_for_task(batch, k, 0) != 0; ++k) {
      memory->at = k;
      by_team(seed, [&](const auto& team) {
        if (gpu::take_task(team, batch, *memory)) gpu::do_work(team, batch, *memory);
      });
    }
  }

  void run_fields(const gpu::SolidPairs& asked, unsigned seed) {
    const std::size_t n = asked.pairs.count;
    std::vector<std::uint32_t> lists[2] = {std::vector<std::uint32_t>(n),
                                           std::vector<std::uint32_t>(n)};
    field_counters = {};
    rounds = 0;
    const gpu::FieldBatch batch = {
        asked, &field_counters, {lists[0].data(), lists[1].data()}, triangle_room()};
    for (std::uint32_t i = 0; i < n; ++i) {
      const int group = gpu::sift_field_pair(batch, i);
      if (group >= 0) gpu::listed_pair(batch, group, field_counters.listed[group]++) = i;
    }
    const auto memory = std::make_unique<gpu::WalkMemory>();
    for (std::uint32_t k = 0; k < field_counters.listed[gpu::kSmooth]; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::sum_field_pair(team, batch, gpu::listed_pair(batch, gpu::kSmooth, k), *memory);
      });
    sum_rounds<gpu::FacetKind>(batch, seed);
    sum_rounds<gpu::MeshKind>(batch, seed);
  }

  gpu::TriangleRoom triangle_room() {
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
    const std::uint32_t listed = field_counters.listed[Kind::kGroup];
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
    const std::uint32_t large = field_counters.large[Kind::kGroup];
    for (std::uint32_t k = 0; k < large + (listed - first); ++k) {
      const std::uint32_t at = k < large ? k : first + (k - large);
      by_team(seed, [&](const auto& team) {
        gpu::sum_whole_query<Kind>(team, batch, gpu::listed_pair(batch, Kind::kGroup, at), *whole);
      });
    }
  }

  HostSolids solids_;
  std::uint32_t room_;
  std::vector<gpu::TriangleQuery> queries_;
  std::vector<gpu::MetPart> parts_;
  std::vector<std::uint32_t> words_;
};

}  // namespace ist::testing
