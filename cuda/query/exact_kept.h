#pragma once

#include <cmath>
#include <cstdint>

#include "base/team.h"
#include "cuda/base/atomics.h"
#include "cuda/query/exact_arrays.h"
#include "cuda/query/exact_search.h"
#include "cuda/query/exact_steps.h"

// Finds triangles among the candidates that exact batches keep (exact_arrays.h). The tests are
// those of a search, box by box, so that the same pairs are found in the same order.

namespace ist::gpu {

/// The number of steps that a margin allows for. Fewer steps keep fewer candidates and need more
/// searches.
constexpr double kMostKeptSteps = 6, kLeastKeptSteps = 1.5;

/// Decides if the kept candidates of pair i are valid at this place or must be renewed. Called once
/// per batch.
IST_HD inline void look_at_kept(const ExactKept& kept, std::uint32_t i, const MeshTree& a,
                                const MeshTree& b, const Similarity& now) {
  // Margins of some steps, within fractions of a triangle's side, as in KeptRing on the CPU.
  constexpr double kLeast = 0.05, kMost = 0.3;
  KeptHead& head = kept.head(i);
  const bool known =
      head.mesh[0] == a.hash && head.mesh[1] == b.hash && head.last.scale == now.scale;
  const KeptMotion step = KeptMotion::of(b, head.last, now);
  head.last = now;
  if (!known) {
    head.mesh[0] = a.hash;
    head.mesh[1] = b.hash;
    head.rest = 0;
    head.steps = kMostKeptSteps;
    head.state = KeptState::none;
    return;
  }
  if (head.state == KeptState::holds) {
    const KeptMotion moved = KeptMotion::of(b, head.found_at, now);
    if (moved.shift <= head.margin.shift && moved.turn <= head.margin.turn) return;
  }
  head.state = KeptState::none;
  if (head.rest > 0) {
    --head.rest;
    return;
  }
  double square = 0;
  for (int k = 0; k < 3; ++k)
    square += (double{b.high[k]} - b.low[k]) * (double{b.high[k]} - b.low[k]);
  const double radius = 0.5 * now.scale * std::sqrt(square);
  const double side = 0.5 * std::fmin(1 / std::sqrt(static_cast<double>(a.level[0].count)),
                                      now.scale / std::sqrt(static_cast<double>(b.level[0].count)));
  const double length = step.shift + step.turn * radius;
  const double margin = std::fmin(std::fmax(head.steps * length, kLeast * side), kMost * side);
  if (!(margin >= kLeastKeptSteps * length)) return;
  const double steps = length > 0 ? margin / length : 0;
  head.margin = {std::fmax(steps * step.shift, 0.25 * margin),
                 std::fmin(std::fmax(steps * step.turn, 0.25 * margin / radius), 0.5)};
  head.found_at = now;
  head.state = KeptState::fresh;
}

/// sift_exact(), followed by look_at_kept() for a pair that needs a search.
IST_HD inline bool sift_kept(const ExactArrays& batch, const ExactKept& kept, std::uint32_t i) {
  PairPlace place;
  if (!sift_exact(batch, i, place)) return false;
  look_at_kept(kept, i, solid_of(batch, batch.pairs.a, i).mesh,
               solid_of(batch, batch.pairs.b, i).mesh, place.a_from_b);
  return true;
}

/// Lists the k-th query of round n if its candidates must be renewed.
IST_HD inline void list_fresh(const ExactArrays& batch, const ExactKept& kept, std::uint32_t n,
                              std::uint32_t k) {
  if (kept.head(batch.queries[k].pair).state == KeptState::fresh)
    kept.list[atomic_add(&kept.round(n).fresh, 1)] = k;
}

/// Sets how far a search looks ahead. The rounding of floats, then and now, is included.
IST_HD inline void look_ahead(const KeptMotion& margin, ExactAheadPair& pair) {
  const MeshTree& b = pair.mesh[1];
  const Similarity& map = pair.place.a_from_b;
  double centre[3], at[3], square = 0;
  for (int k = 0; k < 3; ++k) {
    const double half = 0.5 * (double{b.high[k]} - b.low[k]);
    centre[k] = 0.5 * (double{b.low[k]} + b.high[k]);
    square += half * half;
  }
  map.apply(centre, at);
  for (int k = 0; k < 3; ++k) pair.ahead.centre[k] = static_cast<float>(at[k]);
  const double shift = margin.shift * (1 + margin.turn) + 8 * double{pair.slack};
  pair.ahead.shift = static_cast<float>(1.00001 * shift);
  pair.ahead.turn = static_cast<float>(1.00001 * margin.turn);
  pair.ahead.of_b =
      static_cast<float>(1.00001 * (shift + margin.turn * map.scale * std::sqrt(square)));
}

/// Appends queued triangles to the list of a pair. False if the list is full. Triangles of a pair
/// of blocks are consecutive.
template <class Team>
class KeptWriter {
 public:
  IST_HD KeptWriter(const Team& team, const KeptList& list) : team_(team), list_(list) {}

  IST_HD bool add(const ExactSearchMemory& memory, std::uint32_t first, std::uint32_t count) {
    const auto lane = static_cast<std::uint32_t>(team_.lane());
    const bool has = lane < count;
    const std::uint32_t(&pair)[2] = memory.queue[(first + (has ? lane : 0)) % kExactWaiting];
    const std::uint32_t a = pair[0], b = pair[1], block_a = a / kWidth, block_b = b / kWidth;
    // The previous lane, or the last of the previous batch.
    const int before = lane > 0 ? static_cast<int>(lane) - 1 : 0;
    const std::uint32_t before_a = team_.broadcast(block_a, before),
                        before_b = team_.broadcast(block_b, before);
    const bool fresh = has && (lane > 0 ? block_a != before_a || block_b != before_b
                                        : block_a != last_[0] || block_b != last_[1]);
    int more = 0;
    const std::uint32_t at =
        blocks + static_cast<std::uint32_t>(team_.exclusive_count(fresh, more));
    const std::uint32_t blocks_then = blocks + static_cast<std::uint32_t>(more);
    if (!list_.hold(blocks_then, triangles + count)) return false;
    if (fresh) {
      list_.blocks(at)[0] = block_a;
      list_.blocks(at)[1] = block_b;
    }
    if (has)
      list_.triangles(triangles + lane) = static_cast<std::uint16_t>(
          256 * (fresh ? at : at - 1) + kWidth * (a % kWidth) + b % kWidth);
    blocks = blocks_then;
    triangles += count;
    last_[0] = team_.broadcast(block_a, static_cast<int>(count) - 1);
    last_[1] = team_.broadcast(block_b, static_cast<int>(count) - 1);
    team_.sync();
    return true;
  }

  std::uint32_t blocks = 0, triangles = 0;

 private:
  const Team& team_;
  const KeptList list_;
  std::uint32_t last_[2] = {~0u, ~0u};
};

/// Searches the k-th query of a round and keeps the candidates for B's next motions.
template <class Team>
IST_HD void keep_query(const Team& team, const ExactArrays& batch, const ExactKept& kept,
                       std::uint32_t k, ExactAheadPair& pair, ExactSearchMemory& memory) {
  constexpr std::uint32_t kRest = 30;
  const ExactQuery& query = batch.queries[k];
  KeptHead& head = kept.head(query.pair);
  load_query(team, batch, query, pair);
  if (team.lane() == 0) look_ahead(head.margin, pair);
  team.sync();
  ExactSearch<Team, ExactAheadPair> search(team, pair, memory, memory.waiting,
                                           ExactSearchMemory::kWaiting, {});
  KeptWriter<Team> list(team, kept.list_of(query.pair));
  const bool all = search.run(
      [&](std::uint32_t first, std::uint32_t count) { return list.add(memory, first, count); });
  if (team.lane() != 0) return;
  head.blocks = list.blocks;
  head.triangles = list.triangles;
  head.state = all ? KeptState::holds : KeptState::none;
  head.steps = all ? std::fmin(1.1 * head.steps, kMostKeptSteps) : 0.5 * head.steps;
  if (head.steps >= kLeastKeptSteps) return;
  head.rest = kRest;
  head.steps = kMostKeptSteps;
}

/// Finds the pairs of ExactSearch, in its order, among the kept candidates.
template <class Team>
class KeptSearch {
 public:
  IST_HD KeptSearch(const Team& team, const ExactPair& pair, ExactSearchMemory& memory,
                    const KeptHead& head, const KeptList& list, const ExactPool& pool)
      : team_(team),
        pair_(pair),
        boxes_(pair),
        memory_(memory),
        queue_(team, memory),
        list_(list),
        blocks_(head.blocks),
        triangles_(head.triangles) {
    begin_sifting(team, memory, pool);
  }

  template <class Sift>
  IST_HD bool run(const Sift& sift) {
    const auto lane = static_cast<std::uint32_t>(team_.lane());
    std::uint32_t next = 0;  // of the triangles
    for (std::uint32_t first = 0; first < blocks_; first += kBatch) {
      team_.sync();
      const bool meet = first + lane < blocks_ && blocks_meet(first + lane, box(lane));
      const std::uint32_t found = team_.ballot(meet);
      team_.sync();
      for (int total = Team::kWidth; total == Team::kWidth;) {
        const std::uint32_t n = next + lane;
        const std::uint32_t name = n < triangles_ ? list_.triangles(n) : 0u;
        const std::uint32_t slot = (name / 256 - first) % 256;
        const bool here = n < triangles_ && slot < kBatch;
        const std::uint32_t* const blocks = list_.blocks(here ? first + slot : first);
        const std::uint32_t a = kWidth * blocks[0] + name / kWidth % kWidth,
                            b = kWidth * blocks[1] + name % kWidth;
        const bool waits = here && (found >> slot & 1) != 0 && triangles_meet(a, b, box(slot));
        team_.exclusive_count(here, total);
        next += static_cast<std::uint32_t>(total);
        queue_.add(waits, a, b);
        if (queue_.is_full() && !queue_.sift_next(sift)) return false;
      }
    }
    return queue_.is_empty() || queue_.sift_next(sift);
  }

 private:
  using Boxes = ExactBoxes<ExactPair>;
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static_assert(kBatch <= 2 * kWidth);

  /// The boxes of a pair of blocks: A's, and B's as `other`.
  IST_HD ExactBox& box(std::uint32_t slot) const {
    return memory_.boxes[slot / kWidth][slot % kWidth];
  }

  /// True if a search would reach a pair of blocks, by the boxes and slabs of all nodes above.
  IST_HD bool blocks_meet(std::uint32_t n, ExactBox& out) const {
    const std::uint32_t block[2] = {list_.blocks(n)[0], list_.blocks(n)[1]};
    MeshNode node[2] = {MeshNode::at(pair_.mesh[0].top, 0), MeshNode::at(pair_.mesh[1].top, 0)};
    ExactBox at[2];
    while (node[0].level() > 0 || node[1].level() > 0) {
      bool opens[2];
      boxes_.open(node, opens);
      MeshNode child[2];
      for (int side = 0; side < 2; ++side) {
        const int level = node[side].level() - 1;
        child[side] = opens[side] ? MeshNode::at(level, block[side] >> 4 * level) : node[side];
      }
      bool meet = true;
      for (int side = 0; side < 2; ++side) {
        typename Boxes::Box box;
        meet = boxes_.place_child(side, child[side], node[1 - side], box) && meet;
        boxes_.keep(side, child[side], 0, box, at[side]);
      }
      if (!meet || !boxes_.meet(at[0], at[1])) return false;
      for (int side = 0; side < 2; ++side) node[side] = child[side];
    }
    out.low = at[0].low;
    out.high = at[0].high;
    out.other_low = at[1].other_low;
    out.other_high = at[1].other_high;
    return true;
  }

  /// True if the boxes of two triangles intersect each other and the other's block, and no plane
  /// separates the triangles in float.
  IST_HD bool triangles_meet(std::uint32_t a, std::uint32_t b, const ExactBox& blocks) const {
    float x[2][3][3];  // of a side, a corner
    ExactTriangle of[2];
    bool meet = true;
    const float slack = boxes_.slack();
    for (int side = 0; side < 2; ++side) {
      const std::uint32_t triangle = side == 0 ? a : b;
      const FloatBlock& block = in_global_memory(pair_.in_floats[side])[triangle / kWidth];
      const std::uint32_t corners = block.corner[triangle % kWidth];
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = corners >> 8 * k & 0xFF;
        for (int axis = 0; axis < 3; ++axis) x[side][k][axis] = block.x[axis][v];
        boxes_.place_vertex(side, x[side][k]);
      }
      const Quad by_low = side == 0 ? blocks.other_low : blocks.low,
                 by_high = side == 0 ? blocks.other_high : blocks.high;
      const float wider = side == 0 ? slack : 0;
      for (int axis = 0; axis < 3; ++axis) {
        const float p = x[side][0][axis], q = x[side][1][axis], r = x[side][2][axis];
        const float low = std::fmin(p, std::fmin(q, r)), high = std::fmax(p, std::fmax(q, r));
        meet = meet && low - slack <= by_high.x[axis] && high + slack >= by_low.x[axis];
        of[side].low.x[axis] = low - wider;
        of[side].high.x[axis] = high + wider;
      }
      boxes_.place_plane(x[side][0], x[side][1], x[side][2], by_low, by_high, 0, of[side]);
    }
    for (int axis = 0; axis < 3; ++axis)
      meet = meet && of[0].low.x[axis] <= of[1].high.x[axis] &&
             of[0].high.x[axis] >= of[1].low.x[axis];
    for (int side = 0; side < 2; ++side)
      meet = meet && !Boxes::apart_by(of[side], [&](int k, float(&to)[3]) {
               for (int axis = 0; axis < 3; ++axis) to[axis] = x[1 - side][k][axis];
             });
    return meet;
  }

  const Team& team_;
  const ExactPair& pair_;
  const Boxes boxes_;
  ExactSearchMemory& memory_;
  WaitingTriangles<Team> queue_;
  const KeptList list_;
  const std::uint32_t blocks_, triangles_;
};

/// Searches the k-th pair of a round, among its kept candidates if they are valid.
template <class Team>
IST_HD void search_kept_query(const Team& team, const ExactArrays& batch, const ExactKept& kept,
                              ExactRound& round, std::uint32_t k, ExactPair& pair,
                              ExactSearchMemory& memory) {
  const ExactQuery& query = batch.queries[k];
  const KeptHead& head = kept.head(query.pair);
  if (head.state != KeptState::holds) {
    search_query(team, batch, round, k, pair, memory);
    return;
  }
  load_query(team, batch, query, pair);
  ExactPool pool = batch.pool;
  pool.taken = &round.chunks;
  KeptSearch<Team> search(team, pair, memory, head, kept.list_of(query.pair), pool);
  search.run([&](std::uint32_t first, std::uint32_t count) {
    sift_triangles(team, pair, memory, first, count);
    return true;
  });
  end_search(team, batch, round, k, memory, true, 0);
}

}  // namespace ist::gpu
