#pragma once

#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/exact_pair.h"
#include "cuda/query/exact_search.h"

namespace ist::gpu {

/// Sums of a pair's work, how it stands.
enum class ExactState : std::uint32_t {
  ok,
  unsure,   ///< doubles do not tell
  no_room,  ///< more than the team's memory holds
  wrong,    ///< signs contradict each other
};

/// Of pairs of blocks the triangles that cross: what their segments add to the sums, and how often
/// each edge is pierced. Stages hand pairs on in their order, each a team's width at a time.
template <class Team, bool kExactly>
class ExactCrossings {
 public:
  IST_HD ExactCrossings(const Team& team, ExactMemory& memory, const ExactRoom& room)
      : team_(team), memory_(memory), room_(room) {}

  /// Of the first so many of the room's pairs of blocks; some triangles may wait still.
  IST_HD ExactState run(std::uint32_t block_pairs) {
    for (std::uint32_t n = 0; n < block_pairs && state_ == ExactState::ok; ++n) {
      const std::uint64_t pair = room_.pairs[n];
      meet(static_cast<std::uint32_t>(pair >> 32), static_cast<std::uint32_t>(pair));
    }
    return state_;
  }
  IST_HD ExactState end() {
    while (queued_[0] > 0 && state_ == ExactState::ok) sift();
    while (queued_[1] > 0 && state_ == ExactState::ok) cross();
    return state_;
  }

  IST_HD std::uint32_t count() const { return crossings_; }
  IST_HD std::uint32_t records() const { return records_; }

 private:
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static_assert(kExactWaiting >= 2 * kBatch || kBatch < kWidth);

  /// Boxes of the triangles of two blocks.
  IST_HD void meet(std::uint32_t block_a, std::uint32_t block_b) {
    const std::uint32_t block[2] = {block_a, block_b};
    team_.sync();
    constexpr int kBoth = 2 * static_cast<int>(kWidth);
    for (int k = team_.lane(); k < kBoth; k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth);
      const auto v = static_cast<std::uint32_t>(k) % kWidth;
      const exact::Point x =
          place(side, in_global_memory(memory_.mesh[side].blocks)[block[side]].vertex[v]);
      for (int axis = 0; axis < 3; ++axis)
        memory_.triangles[side].at[axis][v] = static_cast<float>(x[axis]);
    }
    team_.sync();
    for (int k = team_.lane(); k < kBoth; k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth);
      const auto t = static_cast<std::uint32_t>(k) % kWidth;
      const MeshBlock& mesh = in_global_memory(memory_.mesh[side].blocks)[block[side]];
      ExactTriangles& out = memory_.triangles[side];
      const bool used = t < mesh.triangles;
      const std::uint32_t v[3] = {mesh.corner[0][t], mesh.corner[1][t], mesh.corner[2][t]};
      for (int axis = 0; axis < 3; ++axis) {
        const float(&x)[kWidth] = out.at[axis];
        const float low = std::fmin(x[v[0]], std::fmin(x[v[1]], x[v[2]]));
        const float high = std::fmax(x[v[0]], std::fmax(x[v[1]], x[v[2]]));
        out.low[axis][t] = used ? low : kExactFar;
        out.high[axis][t] = used ? high : -kExactFar;
      }
    }
    team_.sync();
    const ExactTriangles &a = memory_.triangles[0], &b = memory_.triangles[1];
    const float reach = memory_.slack;
    const int pairs = narrow_sides(team_, memory_, a.low, a.high, b.low, b.high, reach, b.low,
                                   b.high, a.low, a.high, reach);
    bool marked = false;
    for (int first = 0; first < pairs; first += Team::kWidth) {
      const int k = first + team_.lane();
      const int columns = memory_.count[1];
      const std::uint32_t i = k < pairs ? memory_.left[0][k / columns] : 0,
                          j = k < pairs ? memory_.left[1][k % columns] : 0;
      bool meets = k < pairs;
      for (int axis = 0; axis < 3; ++axis)
        meets = meets && a.low[axis][i] - reach <= b.high[axis][j] &&
                a.high[axis][i] + reach >= b.low[axis][j];
      const std::uint32_t added = push(0, meets, kWidth * block_a + i, kWidth * block_b + j);
      if (added == 0) continue;
      if (!marked && team_.lane() == 0)
        for (int side = 0; side < 2; ++side)
          room_.near[side][block[side] / 32] |= 1u << block[side] % 32;
      marked = true;
      while (queued_[0] >= kBatch) {
        sift();
        if (state_ != ExactState::ok) return;
      }
    }
  }

  /// Appends to a stage's queue, in the order of the lanes; how many.
  IST_HD std::uint32_t push(int stage, bool adds, std::uint32_t a, std::uint32_t b) {
    int total = 0;
    const auto before = static_cast<std::uint32_t>(team_.exclusive_count(adds, total));
    if (adds) {
      std::uint32_t(&slot)[2] =
          memory_.queue[stage][(head_[stage] + queued_[stage] + before) % kExactWaiting];
      slot[0] = a;
      slot[1] = b;
    }
    queued_[stage] += static_cast<std::uint32_t>(total);
    return static_cast<std::uint32_t>(total);
  }
  /// The next of a stage's queue, one a lane; whether this lane has one.
  IST_HD bool pop(int stage, std::uint32_t (&pair)[2]) {
    team_.sync();
    const std::uint32_t taken = queued_[stage] < kBatch ? queued_[stage] : kBatch;
    const auto lane = static_cast<std::uint32_t>(team_.lane());
    const bool has = lane < taken;
    const std::uint32_t(&slot)[2] =
        memory_.queue[stage][(head_[stage] + (has ? lane : 0)) % kExactWaiting];
    pair[0] = slot[0];
    pair[1] = slot[1];
    head_[stage] = (head_[stage] + taken) % kExactWaiting;
    queued_[stage] -= taken;
    team_.sync();
    return has;
  }

  IST_HD exact::Point place(int side, std::uint32_t vertex) const {
    const double* const x = in_global_memory(memory_.mesh[side].vertices) + std::size_t{3} * vertex;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(memory_.place.a_from_b, at);
  }
  IST_HD void load(int side, std::uint32_t triangle, exact::Point (&corners)[3]) const {
    const MeshBlock& block = in_global_memory(memory_.mesh[side].blocks)[triangle / kWidth];
    for (int k = 0; k < 3; ++k)
      corners[k] = place(side, block.vertex[block.corner[k][triangle % kWidth]]);
  }

  /// Blocks of which triangles cross others get records, in the order of the lanes.
  IST_HD void mark(int side, bool crosses, std::uint32_t block) {
    for (;;) {
      const bool fresh = crosses && room_.record[side][block] == 0;
      int waiting = 0;
      const int next = team_.first(fresh, waiting);
      if (next < 0) return;
      if (records_ == room_.most_records) {
        state_ = ExactState::no_room;
        return;
      }
      const std::uint32_t made = team_.broadcast(block, next);
      auto* const words = reinterpret_cast<std::uint32_t*>(room_.records + records_);
      constexpr int kWords = sizeof(CrossedRef) / 4;
      for (int w = team_.lane(); w < kWords; w += Team::kWidth)
        words[w] = w == 0 ? made : w == 1 ? static_cast<std::uint32_t>(side) << 16 : 0;
      ++records_;
      if (team_.lane() == 0) room_.record[side][made] = records_;
      team_.sync();
    }
  }

  /// Leaves out what a plane keeps apart.
  IST_HD void sift() {
    std::uint32_t pair[2];
    bool left = pop(0, pair);
    if (left) {
      exact::Point a[3], b[3];
      load(0, pair[0], a);
      load(1, pair[1], b);
      left = !are_apart(a, b, memory_.aside);
    }
    push(1, left, pair[0], pair[1]);
    if (queued_[1] >= kBatch) cross();
  }

  IST_HD void cross() {
    std::uint32_t pair[2];
    const bool has = pop(1, pair);
    exact::Point corner[2][3];
    PiercingEdge end[2];
    PairSays says = PairSays::apart;
    if (has) {
      load(0, pair[0], corner[0]);
      load(1, pair[1], corner[1]);
      says = cross_pair<kExactly>(corner[0], corner[1], memory_.aside, end);
    }
    if (team_.any(says == PairSays::unsure)) {
      state_ = ExactState::unsure;
      return;
    }
    if (team_.any(says == PairSays::wrong)) {
      state_ = ExactState::wrong;
      return;
    }
    const bool crosses = says == PairSays::crosses;
    int total = 0;
    const int first = team_.first(crosses, total);
    if (total == 0) return;
    exact::EdgeEnd at[2] = {};
    if (crosses)
      for (int e = 0; e < 2; ++e)
        at[e] = exact::edge_end(end[e].p, end[e].q, end[e].height_p, end[e].height_q);
    if (crossings_ == 0) {
      const exact::Point here = at[0].from + at[0].offset;
      const exact::Point origin = {team_.broadcast(here.x, first), team_.broadcast(here.y, first),
                                   team_.broadcast(here.z, first)};
      if (team_.lane() == 0) memory_.origin = origin;
      team_.sync();
    }
    crossings_ += static_cast<std::uint32_t>(total);
    for (int side = 0; side < 2; ++side) {
      mark(side, crosses, pair[side] / kWidth);
      if (state_ != ExactState::ok) return;
    }
    if (crosses) add(pair, corner, end, at);
  }

  IST_HD void add(const std::uint32_t (&pair)[2], exact::Point (&corner)[2][3],
                  const PiercingEdge (&end)[2], const exact::EdgeEnd (&at)[2]) {
    const exact::Point o = memory_.origin;
    exact::Point apex[2];
    std::uint32_t opposite[2];  // the edge opposite to it
    for (int s = 0; s < 2; ++s) {
      for (exact::Point& x : corner[s]) x = x - o;
      const double which =
          exact::apex_of(exact::length_bound(corner[s][0]), exact::length_bound(corner[s][1]),
                         exact::length_bound(corner[s][2]));
      apex[s] = which == 0 ? corner[s][0] : which == 1 ? corner[s][1] : corner[s][2];
      opposite[s] = which == 0 ? 1 : which == 1 ? 2 : 0;
    }
    double counts[2];
    for (std::uint32_t e = 0; e < 2; ++e) {
      const bool enters = e != end[e].of_b;
      const bool is_opposite = (end[e].of_b != 0 ? opposite[1] : opposite[0]) == end[e].edge;
      counts[e] = is_opposite ? (enters ? 1.0 : -1.0) : 0.0;
      note(end[e].of_b, end[e].of_b != 0 ? pair[1] : pair[0], end[e].edge, enters,
           !at[e].from_second);
    }
    exact::PieceTerms terms;
    exact::segment_terms({at[0].from - o, at[1].from - o}, {at[0].offset, at[1].offset}, apex,
                         {end[0].of_b != 0, end[1].of_b != 0}, counts, {end[0].error, end[1].error},
                         terms);
    const int lane = team_.lane();
    double(&sum)[ExactSum::kCount][32] = memory_.sum;
    for (const double six : terms.six_volumes) {
      double rest;
      exact::two_sum(sum[ExactSum::kHigh][lane], six, sum[ExactSum::kHigh][lane], rest);
      sum[ExactSum::kLow][lane] += rest;
    }
    sum[ExactSum::kRounding][lane] += terms.rounding;
    for (int k = 0; k < 3; ++k) {
      sum[ExactSum::kMoment + k][lane] += terms.moment[k];
      sum[ExactSum::kPush + k][lane] += terms.force[k];
      sum[ExactSum::kTurn + k][lane] += terms.torque[k];
    }
  }

  /// An edge is pierced.
  IST_HD void note(std::uint32_t of_b, std::uint32_t triangle, std::uint32_t edge, bool enters,
                   bool from_first) {
    CrossedRef& record = room_.records[room_.record[of_b][triangle / kWidth] - 1];
    const std::uint32_t number = 3 * (triangle % kWidth) + edge;
    const std::uint32_t sign = enters ? 1u : ~0u;
    atomic_or(&record.pierced[number / 32], 1u << number % 32);
    atomic_add(&record.edge[number], (sign << 16) + (from_first ? sign : 0));
  }

  const Team& team_;
  ExactMemory& memory_;
  const ExactRoom& room_;
  ExactState state_ = ExactState::ok;
  std::uint32_t head_[2] = {0, 0}, queued_[2] = {0, 0};
  std::uint32_t crossings_ = 0, records_ = 0;
};

}  // namespace ist::gpu
