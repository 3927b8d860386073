#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "base/team.h"
#include "cuda/base/atomics.h"
#include "cuda/query/disc_sums.h"
#include "cuda/query/facet_fields.h"
#include "cuda/query/field_batch.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/lens_sums.h"

// Trees against the triangles of boxes and terrains. A round takes pairs through steps that each
// fit the instruction cache: place them, find the balls that triangles intersect, sum these, write
// answers. A round ends when its memory is full. Pairs that are too large for a round, or that come
// after the last one, go through all steps by one team, with the same bits.

namespace ist::gpu {

/// The memory of a team that sums parts, and of one that also traverses trees.
struct FacetSumMemory : ProbeMemory {
  DiscMemory<FacetId> discs;
};
struct FacetWholeMemory : FacetWalkMemory {
  DiscMemory<FacetId> discs;
};

IST_HD inline TriangleRound& round_of(const FieldBatch& batch, std::uint32_t n) {
  return batch.counters->round[n % 2];
}

/// The number of pairs of a round that begins at `first` of the list, if all are traversed.
IST_HD inline std::uint32_t pairs_from(const FieldBatch& batch, std::uint32_t first) {
  const std::uint32_t left = batch.counters->listed[kFacets] - first;
  return left < batch.work.query_capacity ? left : batch.work.query_capacity;
}

/// The number of traversed pairs of a round.
IST_HD inline std::uint32_t walked_of(const FieldBatch& batch, const TriangleRound& round) {
  const std::uint32_t most = pairs_from(batch, round.first);
  return round.walked < most ? round.walked : most;
}

/// The position in the list at which the next round begins.
IST_HD inline std::uint32_t end_of(const FieldBatch& batch, const TriangleRound& round) {
  return round.first + walked_of(batch, round);
}

/// Places the k-th pair of a round, which is pair `listed` of the whole list. One thread per pair.
IST_HD inline void place_query(const FieldBatch& batch, std::uint32_t k, std::uint32_t listed) {
  TriangleQuery& query = batch.work.queries[k];
  query.pair = listed_pair(batch, kFacets, listed);
  place_field_pair(batch, query.pair, query.place);
  query.first_part = kNoPart;
}

/// Estimates whether a round has memory for one more pair. `teams`: the number of teams that
/// traverse trees; each may still need as many words as earlier pairs took.
IST_HD inline bool goes_on(const FieldBatch& batch, const TriangleRound& round,
                           std::uint32_t teams) {
  constexpr std::uint32_t kLeastEach = 512;
  const std::uint32_t words = atomic_load(&round.words);
  const std::uint32_t each = words / (atomic_load(&round.walked) + 1);
  return words + std::uint64_t{teams} * (each > kLeastEach ? each : kLeastEach) <=
         batch.work.word_capacity;
}

/// Stores a part that follows the part `before`; kNoPart if there is no memory. Called by the whole
/// team.
template <class Team, class Id>
IST_HD std::uint32_t keep_part(const Team& team, const TriangleWorkspace& work,
                               TriangleRound& round, std::uint32_t query, std::uint32_t before,
                               const MetView<Id>& met) {
  constexpr std::uint32_t kIdWords = sizeof(Id) / sizeof(std::uint32_t);
  const auto balls = static_cast<std::uint32_t>(met.ball_count);
  const auto pairs = static_cast<std::uint32_t>(met.pair_count);
  const std::uint32_t words = balls + kIdWords * pairs + (pairs + 3) / 4;
  std::uint32_t part = kNoPart, first = 0;
  // Counters stop growing soon after memory is full, so that they never overflow.
  if (team.lane() == 0 && atomic_load(&round.parts) < work.part_capacity &&
      atomic_load(&round.words) < work.word_capacity) {
    const std::uint32_t taken = atomic_add(&round.parts, 1);
    first = atomic_add(&round.words, words);
    const bool fits = first + words <= work.word_capacity;
    if (taken < work.part_capacity) {
      work.parts[taken] = {query, kNoPart, first, fits ? balls : 0, fits ? pairs : 0, {}};
      (before == kNoPart ? work.queries[query].first_part : work.parts[before].next) = taken;
      part = fits ? taken : kNoPart;
    }
  }
  part = team.broadcast(part, 0);
  first = team.broadcast(first, 0);
  if (part == kNoPart) return part;
  MetBall* const to = work.words + first;
  auto* const triangles = reinterpret_cast<Id*>(to + balls);
  auto* const of_ball = reinterpret_cast<std::uint8_t*>(triangles + pairs);
  for (int k = team.lane(); k < met.ball_count; k += Team::kWidth) to[k] = met.balls[k];
  for (int k = team.lane(); k < met.pair_count; k += Team::kWidth) {
    triangles[k] = met.triangles[k];
    of_ball[k] = met.of_ball[k];
  }
  return part;
}

template <class Id>
IST_HD MetView<Id> met_of(const TriangleWorkspace& work, const MetPart& part) {
  const MetBall* const balls = work.words + part.first_word;
  const auto* const triangles = reinterpret_cast<const Id*>(balls + part.balls);
  return {balls, triangles, reinterpret_cast<const std::uint8_t*>(triangles + part.pairs),
          static_cast<int>(part.balls), static_cast<int>(part.pairs)};
}

template <class Team>
IST_HD void load_query(const Team& team, const FieldBatch& batch, const TriangleQuery& query,
                       ProbeMemory& memory) {
  copy_words(team, query.place, memory.place);
  load_solids(team, batch, query.pair, memory);
}

/// Traverses the k-th pair of a round. Stores its parts, or lists it among the large.
template <class Team>
IST_HD void walk_query(const Team& team, const FieldBatch& batch, TriangleRound& round,
                       std::uint32_t k, FacetWalkMemory& memory) {
  TriangleQuery& query = batch.work.queries[k];
  load_query(team, batch, query, memory);
  PartSums sums;
  FacetWalk<Team> walk(team, memory, sums);
  walk.start();
  std::uint32_t part = kNoPart;
  bool fits = true;
  walk.run([&](const MetView<FacetId>& met, bool end) {
    fits = end;
    if (!end || met.ball_count == 0) return end;
    part = keep_part(team, batch.work, round, k, part, met);
    fits = part != kNoPart;
    return fits;
  });
  const LensTotals totals = sums.total(team);
  if (team.lane() == 0) {
    query.walked = totals;
    query.fits = fits;
    if (!fits) listed_pair(batch, kFacets, atomic_add(&batch.counters->large, 1)) = query.pair;
  }
  team.sync();
}

/// Sums the k-th part of a round.
template <class Team>
IST_HD void sum_part(const Team& team, const FieldBatch& batch, std::uint32_t k,
                     FacetSumMemory& memory) {
  MetPart& part = batch.work.parts[k];
  load_query(team, batch, batch.work.queries[part.query], memory);
  PartSums sums;
  DiscSums<Team, FacetSource> discs(team, memory, memory.discs, {memory.field, memory.whole}, sums);
  discs.add(met_of<FacetId>(batch.work, part), true);
  const LensTotals totals = sums.total(team);
  if (team.lane() == 0) part.totals = totals;
  team.sync();
}

/// Writes the answer of the k-th pair of a round. One thread per pair.
IST_HD inline void answer_query(const FieldBatch& batch, std::uint32_t k) {
  const TriangleQuery& query = batch.work.queries[k];
  if (!query.fits) return;
  LensTotals sum;
  sum.clear();
  for (std::uint32_t next = query.first_part; next != kNoPart;) {
    const MetPart& part = batch.work.parts[next];
    sum.add(part.totals);
    next = part.next;
  }
  sum.add(query.walked);
  write_field_answer(batch, query.pair, query.place, sum);
}

template <class Team>
IST_HD void sum_whole_query(const Team& team, const FieldBatch& batch, std::uint32_t i,
                            FacetWholeMemory& memory) {
  if (team.lane() == 0) place_field_pair(batch, i, memory.place);
  load_solids(team, batch, i, memory);
  PartSums walked, sums;
  FacetWalk<Team> walk(team, memory, walked);
  DiscSums<Team, FacetSource> discs(team, memory, memory.discs, {memory.field, memory.whole}, sums);
  walk.start();
  LensTotals total;
  total.clear();
  walk.run([&](const MetView<FacetId>& met, bool end) {
    if (met.ball_count == 0) return true;
    discs.add(met, end);
    if (end) {
      total.add(sums.total(team));
      sums = {};
    }
    return true;
  });
  total.add(walked.total(team));
  if (team.lane() == 0) write_field_answer(batch, i, memory.place, total);
  team.sync();
}

}  // namespace ist::gpu
