#pragma once

#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/disc_sums.h"
#include "cuda/query/facet_fields.h"
#include "cuda/query/field_batch.h"
#include "cuda/query/surface_walk.h"
#include "numerics/host_device.h"
#include "numerics/team.h"

// Trees against triangles: meshes, boxes, terrains. A round takes pairs of a batch through steps of
// which each fits the instruction cache: they are placed, walks find what meets, that is summed,
// answers are written. The next begins where the room of one has come to its end. Pairs that are
// too large for a round, or for which there is none left, go through all steps by one team, to the
// same bits.

namespace ist::gpu {

/// Memory of a team that sums parts. `More`: what the source needs.
template <class Source, class More>
struct MetMemory : More {
  DiscMemory<typename Source::Id> discs;
};

/// Meshes: their group, what has their triangles, who walks them, and the memory of both.
struct MeshKind {
  static constexpr FieldGroup kGroup = kMesh;
  using Source = SurfaceSource;
  using WalkMemory = SurfaceWalkMemory;
  struct ProbeRoom : ProbeMemory {
    SurfaceNode open[kOpenRoom];
  };
  template <class Team>
  using Walk = SurfaceWalk<Team>;

  template <class Memory>
  IST_HD static Source source(Memory& memory) {
    return {memory.field.mesh, memory.open};
  }
  template <class Team>
  IST_HD static bool root_inside(const Team& team, const FieldRef& field, const TreeRef& tree,
                                 const Similarity& a_from_b) {
    double centre[3], reach;
    node_ball(tree, tree.top, 0, a_from_b, centre, reach);
    return inside_surface(team, field.mesh, team.lane() == 0, centre);
  }
};

/// Boxes and terrains.
struct FacetKind {
  static constexpr FieldGroup kGroup = kFacets;
  using Source = FacetSource;
  using WalkMemory = FacetWalkMemory;
  using ProbeRoom = ProbeMemory;
  template <class Team>
  using Walk = FacetWalk<Team>;

  IST_HD static Source source(const ProbeMemory& memory) { return {memory.field, memory.whole}; }
  /// Its sides are told ball by ball.
  template <class Team>
  IST_HD static bool root_inside(const Team&, const FieldRef&, const TreeRef&, const Similarity&) {
    return false;
  }
};

template <class Kind>
using SumMemory = MetMemory<typename Kind::Source, typename Kind::ProbeRoom>;
template <class Kind>
using WholeMemory = MetMemory<typename Kind::Source, typename Kind::WalkMemory>;

/// The counters of the n-th round.
template <class Kind>
IST_HD TriangleRound& round_of(const FieldBatch& batch, std::uint32_t n) {
  return batch.counters->round[Kind::kGroup][n % 2];
}

/// Pairs of a round that begins with the first-th of those listed, if all are walked.
template <class Kind>
IST_HD std::uint32_t pairs_from(const FieldBatch& batch, std::uint32_t first) {
  const std::uint32_t left = batch.counters->listed[Kind::kGroup] - first;
  return left < batch.room.query_room ? left : batch.room.query_room;
}

/// Pairs of a round that were walked.
template <class Kind>
IST_HD std::uint32_t walked_of(const FieldBatch& batch, const TriangleRound& round) {
  const std::uint32_t most = pairs_from<Kind>(batch, round.first);
  return round.walked < most ? round.walked : most;
}

/// Where the round after this one begins.
template <class Kind>
IST_HD std::uint32_t end_of(const FieldBatch& batch, const TriangleRound& round) {
  return round.first + walked_of<Kind>(batch, round);
}

/// Places the k-th pair of a round, `listed` among all; by one thread.
template <class Kind>
IST_HD void place_query(const FieldBatch& batch, std::uint32_t k, std::uint32_t listed) {
  TriangleQuery& query = batch.room.queries[k];
  query.pair = listed_pair(batch, Kind::kGroup, listed);
  place_field_pair(batch, query.pair, query.place);
  query.first_part = kNoPart;
  const FieldSides sides(batch, query.pair);
  const SolidRef& asset = solid_of(batch, sides.tree, query.pair);
  query.inside =
      Kind::root_inside(SerialTeam(), solid_of(batch, sides.field, query.pair).field,
                        asset.tree[static_cast<int>(batch.measure)], query.place.a_from_b);
}

/// Whether a round has room for one more pair, as far as can be told. `teams`: those that walk, of
/// which each may still need as many words as pairs took before.
IST_HD inline bool goes_on(const FieldBatch& batch, const TriangleRound& round,
                           std::uint32_t teams) {
  constexpr std::uint32_t kLeastEach = 512;
  const std::uint32_t words = atomic_load(&round.words);
  const std::uint32_t each = words / (atomic_load(&round.walked) + 1);
  return words + std::uint64_t{teams} * (each > kLeastEach ? each : kLeastEach) <=
         batch.room.word_room;
}

/// Takes room for a part that follows the one `before`, and keeps it there; kNoPart if there is
/// none. All of the team together.
template <class Team, class Id>
IST_HD std::uint32_t keep_part(const Team& team, const TriangleRoom& room, TriangleRound& round,
                               std::uint32_t query, std::uint32_t before, const MetView<Id>& met) {
  constexpr std::uint32_t kIdWords = sizeof(Id) / sizeof(std::uint32_t);
  const auto balls = static_cast<std::uint32_t>(met.ball_count);
  const auto pairs = static_cast<std::uint32_t>(met.pair_count);
  const std::uint32_t words = balls + kIdWords * pairs + (pairs + 3) / 4;
  std::uint32_t part = kNoPart, first = 0;
  // Counters stop soon after the room ends, so that nothing turns them over.
  if (team.lane() == 0 && atomic_load(&round.parts) < room.part_room &&
      atomic_load(&round.words) < room.word_room) {
    const std::uint32_t taken = atomic_add(&round.parts, 1);
    first = atomic_add(&round.words, words);
    const bool fits = first + words <= room.word_room;
    if (taken < room.part_room) {
      room.parts[taken] = {query, kNoPart, first, fits ? balls : 0, fits ? pairs : 0, {}};
      (before == kNoPart ? room.queries[query].first_part : room.parts[before].next) = taken;
      part = fits ? taken : kNoPart;
    }
  }
  part = team.broadcast(part, 0);
  first = team.broadcast(first, 0);
  if (part == kNoPart) return part;
  MetBall* const to = room.words + first;
  auto* const triangles = reinterpret_cast<Id*>(to + balls);
  auto* const of_ball = reinterpret_cast<std::uint8_t*>(triangles + pairs);
  for (int k = team.lane(); k < met.ball_count; k += Team::kWidth) to[k] = met.balls[k];
  for (int k = team.lane(); k < met.pair_count; k += Team::kWidth) {
    triangles[k] = met.triangles[k];
    of_ball[k] = met.of_ball[k];
  }
  return part;
}

/// A part as it was kept.
template <class Id>
IST_HD MetView<Id> met_of(const TriangleRoom& room, const MetPart& part) {
  const MetBall* const balls = room.words + part.first_word;
  const auto* const triangles = reinterpret_cast<const Id*>(balls + part.balls);
  return {balls, triangles, reinterpret_cast<const std::uint8_t*>(triangles + part.pairs),
          static_cast<int>(part.balls), static_cast<int>(part.pairs)};
}

/// Readies the memory for a query.
template <class Team>
IST_HD void load_query(const Team& team, const FieldBatch& batch, const TriangleQuery& query,
                       ProbeMemory& memory) {
  copy_words(team, query.place, memory.place);
  load_solids(team, batch, query.pair, memory);
}

/// Walks the k-th pair of a round: its parts are kept, or it is listed among the large.
template <class Kind, class Team>
IST_HD void walk_query(const Team& team, const FieldBatch& batch, TriangleRound& round,
                       std::uint32_t k, typename Kind::WalkMemory& memory) {
  TriangleQuery& query = batch.room.queries[k];
  load_query(team, batch, query, memory);
  PartSums sums;
  typename Kind::template Walk<Team> walk(team, memory, sums);
  walk.start(query.inside);
  std::uint32_t part = kNoPart;
  bool fits = true;
  walk.run([&](const MetView<typename Kind::Source::Id>& met, bool end) {
    fits = end;
    if (!end || met.ball_count == 0) return end;
    part = keep_part(team, batch.room, round, k, part, met);
    fits = part != kNoPart;
    return fits;
  });
  const LensTotals totals = sums.total(team);
  if (team.lane() == 0) {
    query.walked = totals;
    query.fits = fits;
    if (!fits)
      listed_pair(batch, Kind::kGroup, atomic_add(&batch.counters->large[Kind::kGroup], 1)) =
          query.pair;
  }
  team.sync();
}

/// Sums the k-th part of a round.
template <class Kind, class Team>
IST_HD void sum_part(const Team& team, const FieldBatch& batch, std::uint32_t k,
                     SumMemory<Kind>& memory) {
  MetPart& part = batch.room.parts[k];
  load_query(team, batch, batch.room.queries[part.query], memory);
  PartSums sums;
  DiscSums<Team, typename Kind::Source> discs(team, memory, memory.discs, Kind::source(memory),
                                              sums);
  discs.add(met_of<typename Kind::Source::Id>(batch.room, part), true);
  const LensTotals totals = sums.total(team);
  if (team.lane() == 0) part.totals = totals;
  team.sync();
}

/// Answers the k-th pair of a round, by one thread.
IST_HD inline void answer_query(const FieldBatch& batch, std::uint32_t k) {
  const TriangleQuery& query = batch.room.queries[k];
  if (!query.fits) return;
  LensTotals sum;
  sum.clear();
  for (std::uint32_t next = query.first_part; next != kNoPart;) {
    const MetPart& part = batch.room.parts[next];
    sum.add(part.totals);
    next = part.next;
  }
  sum.add(query.walked);
  write_field_answer(batch, query.pair, query.place, sum);
}

/// All steps of pair i.
template <class Kind, class Team>
IST_HD void sum_whole_query(const Team& team, const FieldBatch& batch, std::uint32_t i,
                            WholeMemory<Kind>& memory) {
  if (team.lane() == 0) place_field_pair(batch, i, memory.place);
  load_solids(team, batch, i, memory);
  PartSums walked, sums;
  typename Kind::template Walk<Team> walk(team, memory, walked);
  DiscSums<Team, typename Kind::Source> discs(team, memory, memory.discs, Kind::source(memory),
                                              sums);
  walk.start(Kind::root_inside(team, memory.field, memory.tree, memory.place.a_from_b));
  LensTotals total;
  total.clear();
  walk.run([&](const MetView<typename Kind::Source::Id>& met, bool end) {
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
