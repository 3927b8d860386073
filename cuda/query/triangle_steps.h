#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "base/team.h"
#include "cuda/base/atomics.h"
#include "cuda/query/facet_fields.h"
#include "cuda/query/field_batch.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/lens_sums.h"
#include "query/asset/shared_constants.h"
#include "query/ball_triangle/disc.h"

// Trees against the triangles of boxes and terrains. A round takes pairs through steps that each
// fit the instruction cache: place them, find the balls that triangles intersect, sum these, write
// answers. A round ends when its memory is used up. Pairs that are too large for a round, or that
// come after the last one, go through all steps by one team, with the same bits.

namespace ist::gpu {

// One team computes, for balls that triangles intersect, the exact part inside the closed surface,
// as add_patch() and total_of() do (query/ball_triangle/patch_sums.h, query/shape/patch_shapes.h).
// Discs that edges cut go to a list, so that all lanes of a warp work on the expensive case.

constexpr std::uint32_t kNoBall = ~0u;
constexpr int kCutCapacity = 64;  ///< the rest of a round of a warp, and what a round may add
static_assert(kCutCapacity >= 2 * 32 - 1);
template <class Id>
struct BallTriangle {
  std::uint32_t ball;
  Id triangle;
};

template <class Id>
struct DiscMemory {
  double x[3][kHeldBalls], r[kHeldBalls];
  double cones[kHeldBalls], angle[kHeldBalls];
  std::uint32_t inside[kHeldBalls];  ///< true if the centre is inside
  std::uint32_t on_edge[kHeldBalls];
  BallTriangle<Id> cut[kCutCapacity];
};

/// Source: as BallTests has it.
template <class Team, class Source>
class DiscSums {
 public:
  using Id = typename Source::Id;

  IST_HD DiscSums(const Team& team, const ProbeMemory& probe, DiscMemory<Id>& memory,
                  const Source& source, PartSums& sums)
      : team_(team), probe_(probe), m_(memory), source_(source), sums_(sums) {}

  /// Sums the listed pairs and, at the `end` of a part, the kept balls; then the source's memory
  /// must be free. Several calls may belong to one part.
  IST_HD void add(const MetView<Id>& met, bool end) {
    load(met);
    int next = 0;
    for (;;) {
      const bool of_cut = cut_ >= Team::kWidth || (next == met.pair_count && cut_ > 0);
      if (!of_cut && next == met.pair_count) break;
      drain(met, of_cut, next);
    }
    if (end) finish(met);
  }

 private:
  /// Places the balls that were added since the last call.
  IST_HD void load(const MetView<Id>& met) {
    IST_ROLLED
    for (int ball = held_ + team_.lane(); ball < met.ball_count; ball += Team::kWidth) {
      const std::uint32_t number = met.balls[ball] & ~kCentreInside;
      double x[3];
      place_ball(probe_, 0, number / kWidth, static_cast<int>(number % kWidth), x, m_.r[ball]);
      for (int k = 0; k < 3; ++k) m_.x[k][ball] = x[k];
      m_.cones[ball] = m_.angle[ball] = 0;
      m_.on_edge[ball] = 0;
    }
    held_ = met.ball_count;
    team_.sync();
  }

  /// Takes a team's width of listed pairs, or the rest. A pair is discarded, summed, or listed
  /// again if edges cut its disc.
  IST_HD void drain(const MetView<Id>& met, bool of_cut, int& next) {
    const int listed = of_cut ? cut_ : met.pair_count - next;
    const int take = listed < Team::kWidth ? listed : Team::kWidth;
    const int first = of_cut ? cut_ - take : next;
    cut_ -= of_cut ? take : 0;
    next += of_cut ? 0 : take;
    DiscKind kind = DiscKind::apart;
    BallTriangle<Id> pair = {kNoBall, {}};
    DiscPart part = {0, 0, 0, 0};
    if (team_.lane() < take) {
      const int at = first + team_.lane();
      pair = of_cut ? m_.cut[at] : BallTriangle<Id>{met.of_ball[at], met.triangles[at]};
      const auto ball = static_cast<int>(pair.ball);
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]};
      double c[3][3];
      source_.corners(pair.triangle, c);
      const TrianglePlane t(c);
      const Disc disc(t, x, m_.r[ball]);
      kind = of_cut ? DiscKind::cut : disc.kind();
      if (!of_cut && disc.on_edge()) m_.on_edge[ball] = 1;
      if (of_cut || kind == DiscKind::whole) {
        part = of_cut ? disc.within_edges() : disc.whole();
        add_pull(t, x, part);
      }
    }
    if (!of_cut) {
      int total = 0;
      const int place = cut_ + team_.exclusive_count(kind == DiscKind::cut, total);
      if (kind == DiscKind::cut) m_.cut[place] = pair;
      cut_ += total;
      sums_.spheres += kind != DiscKind::apart ? 1 : 0;
    }
    share_out(of_cut || kind == DiscKind::whole ? pair.ball : kNoBall, part);
  }

  /// Sums the kept balls, once no pair is listed.
  IST_HD void finish(const MetView<Id>& met) {
    for (int ball = team_.lane(); ball < held_; ball += Team::kWidth)
      m_.inside[ball] = met.balls[ball] >= kCentreInside ? 1 : 0;
    team_.sync();
    IST_ROLLED
    for (int base = 0; base < held_; base += Team::kWidth) {
      const int ball = base + team_.lane();
      bool on_edge = ball < held_ && m_.on_edge[ball] != 0;
      while (team_.any(on_edge)) {
        int total = 0;
        const int lane = team_.first(on_edge, total);
        put_right(team_, m_, source_, base + lane);
        if (lane == team_.lane()) on_edge = false;
      }
      if (ball >= held_) continue;
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]}, angle = m_.angle[ball];
      const bool told = std::fabs(angle) > kLeastAngle;
      add_ball(probe_.place.a_from_b, x, m_.r[ball], told ? angle < 0 : m_.inside[ball] != 0,
               m_.cones[ball], sums_);
    }
    held_ = 0;
    team_.sync();
  }

  /// Adds the terms that are linear in the surface to the lane's own sums.
  IST_HD void add_pull(const TrianglePlane& t, const double (&x)[3], const DiscPart& part) {
    double at[3], push[3], shift[3];
    for (int k = 0; k < 3; ++k) {
      at[k] = x[k] - probe_.place.a_from_b.t[k];
      push[k] = -t.n[k] * part.area;
      shift[k] = -t.n[k] * (0.5 * part.second);
    }
    sums_.add(at, 0, push, shift);
  }

  /// Adds the lanes' cones and angles to those of their balls, in the order of the lanes.
  IST_HD void share_out(std::uint32_t of_ball, const DiscPart& part) {
    const bool shares = of_ball != kNoBall;
    std::uint32_t alike = team_.alike(of_ball);
    const bool leads = shares && lowest_bit(alike) == team_.lane();
    alike = leads ? alike : 0;
    double cones = 0, angle = 0;
    while (team_.any(alike != 0)) {
      const int from = alike != 0 ? lowest_bit(alike) : team_.lane();
      const double c = team_.broadcast(part.cones, from), a = team_.broadcast(part.angle, from);
      if (alike == 0) continue;
      cones += c;
      angle += a;
      alike &= alike - 1;
    }
    if (leads) {
      m_.cones[of_ball] += cones;
      m_.angle[of_ball] += angle;
    }
    team_.sync();
  }

  /// Computes the cones, angle and side of a ball whose centre lies on an edge from a point beside
  /// it: put_right() (query/ball_triangle/patch_sums.h).
  IST_HD_COLD static void put_right(const Team team, DiscMemory<Id>& m, const Source source,
                                    int ball) {
    const double r = m.r[ball];
    const double x[3] = {m.x[0][ball], m.x[1][ball], m.x[2][ball]};
    double moved[3] = {x[0], x[1], x[2]};
    move_away(r, moved);
    double cones = 0, angle = 0, pull[3] = {0, 0, 0};
    source.each_near(team, x, r * (1 + kMoved), [&](bool there, const Id& id) {
      if (!there) return;
      double c[3][3];
      source.corners(id, c);
      const TrianglePlane t(c);
      if (t.flat) return;
      const DiscPart here = Disc(t, x, r).part(), beside = Disc(t, moved, r).part();
      for (int k = 0; k < 3; ++k) pull[k] += t.n[k] * (here.area + beside.area);
      cones += beside.cones;
      angle += beside.angle;
    });
    double change = 0;
    for (int k = 0; k < 3; ++k) change += 0.5 * team.sum(pull[k]) * (moved_along(k) * r);
    cones = team.sum(cones);
    angle = team.sum(angle);
    const bool inside = source.inside(team, team.lane() == 0, moved);
    if (team.lane() == 0) {
      m.cones[ball] = cones + change;
      m.angle[ball] = angle;
      m.inside[ball] = inside ? 1 : 0;
    }
    team.sync();
  }

  const Team& team_;
  const ProbeMemory& probe_;
  DiscMemory<Id>& m_;
  const Source source_;
  PartSums& sums_;
  int held_ = 0;  ///< balls that are placed
  int cut_ = 0;   ///< listed
};

/// The memory of a team that sums parts, and of one that also traverses trees.
struct FacetSumMemory : ProbeMemory {
  DiscMemory<FacetId> discs;
};
struct FacetWholeMemory : FacetWalkMemory {
  DiscMemory<FacetId> discs;
};

/// The counters of the n-th round.
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

/// Estimates if a round has memory for one more pair. `teams`: the number of teams that traverse
/// trees; each may still need as many words as earlier pairs took.
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

/// A view of a stored part.
template <class Id>
IST_HD MetView<Id> met_of(const TriangleWorkspace& work, const MetPart& part) {
  const MetBall* const balls = work.words + part.first_word;
  const auto* const triangles = reinterpret_cast<const Id*>(balls + part.balls);
  return {balls, triangles, reinterpret_cast<const std::uint8_t*>(triangles + part.pairs),
          static_cast<int>(part.balls), static_cast<int>(part.pairs)};
}

/// Loads a query into memory.
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

/// Runs all steps of pair i.
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
