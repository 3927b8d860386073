#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/exact_pair.h"
#include "cuda/query/exact_search.h"

namespace ist::gpu {

/// How the work on a pair stands.
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

  /// Of the first so many of the room's pairs of blocks; some triangles may wait still, unless it
  /// `ends`. All in one loop: the code of each stage is there once and stays in the instruction
  /// cache.
  IST_HD ExactState run(std::uint32_t block_pairs, bool ends) {
    std::uint32_t next = 0;
    pairs_ = at_ = 0;
    while (state_ == ExactState::ok) {
      const bool last = ends && next == block_pairs && at_ >= pairs_;
      if (queued_[1] >= kBatch || (last && queued_[0] == 0 && queued_[1] > 0))
        cross();
      else if (queued_[0] >= kBatch || (last && queued_[0] > 0))
        sift();
      else if (at_ < pairs_)
        meet();
      else if (next < block_pairs)
        place_blocks(room_.pairs[next++]);
      else
        break;
    }
    return state_;
  }

  IST_HD std::uint32_t count() const { return crossings_; }
  IST_HD std::uint32_t records() const { return records_; }

 private:
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static_assert(kExactWaiting >= 2 * kBatch || kBatch < kWidth);

  /// Boxes of the triangles of two blocks.
  IST_HD void place_blocks(std::uint64_t pair) {
    const std::uint32_t block[2] = {static_cast<std::uint32_t>(pair >> 32),
                                    static_cast<std::uint32_t>(pair)};
    block_[0] = block[0];
    block_[1] = block[1];
    team_.sync();
    constexpr int kBoth = 2 * static_cast<int>(kWidth);
    for (int k = team_.lane(); k < kBoth; k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth);
      const auto v = static_cast<std::uint32_t>(k) % kWidth;
      const exact::Point x =
          memory_.vertex(side, in_global_memory(memory_.mesh[side].blocks)[block[side]].vertex[v]);
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
    at_ = 0;
    pairs_ = narrow_sides(team_, memory_, a.low, a.high, b.low, b.high, memory_.slack, b.low,
                          b.high, a.low, a.high, memory_.slack);
  }

  /// The next of their pairs of triangles whose boxes meet.
  IST_HD void meet() {
    const ExactTriangles &a = memory_.triangles[0], &b = memory_.triangles[1];
    const float reach = memory_.slack;
    const int k = at_ + team_.lane(), columns = memory_.count[1];
    const std::uint32_t i = k < pairs_ ? memory_.left[0][k / columns] : 0,
                        j = k < pairs_ ? memory_.left[1][k % columns] : 0;
    bool meets = k < pairs_;
    for (int axis = 0; axis < 3; ++axis)
      meets = meets && a.low[axis][i] - reach <= b.high[axis][j] &&
              a.high[axis][i] + reach >= b.low[axis][j];
    at_ += Team::kWidth;
    push(0, meets, kWidth * block_[0] + i, kWidth * block_[1] + j);
  }

  /// Appends to a stage's queue, in the order of the lanes.
  IST_HD void push(int stage, bool adds, std::uint32_t a, std::uint32_t b) {
    int total = 0;
    const auto before = static_cast<std::uint32_t>(team_.exclusive_count(adds, total));
    if (adds) {
      std::uint32_t(&slot)[2] =
          memory_.queue[stage][(head_[stage] + queued_[stage] + before) % kExactWaiting];
      slot[0] = a;
      slot[1] = b;
    }
    queued_[stage] += static_cast<std::uint32_t>(total);
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

  IST_HD void load(int side, std::uint32_t triangle, exact::Point (&corners)[3]) const {
    const MeshBlock& block = in_global_memory(memory_.mesh[side].blocks)[triangle / kWidth];
    IST_ROLLED
    for (int k = 0; k < 3; ++k)
      corners[k] = memory_.vertex(side, block.vertex[block.corner[k][triangle % kWidth]]);
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

  /// Leaves out what a plane keeps apart. Blocks of which a pair might cross, or not, if points
  /// moved by the room are marked as near.
  IST_HD void sift() {
    std::uint32_t pair[2];
    const bool has = pop(0, pair);
    Apart apart = Apart::no;
    if (has) {
      apart = by_plane(1, pair);
      if (apart != Apart::settled) {
        const Apart other = by_plane(0, pair);
        if (other > apart) apart = other;
      }
      if (apart != Apart::settled)
        for (int side = 0; side < 2; ++side) {
          const std::uint32_t block = pair[side] / kWidth;
          atomic_or(&room_.near[side][block / 32], 1u << block % 32);
        }
    }
    push(1, has && apart == Apart::no, pair[0], pair[1]);
  }

  enum class Apart {
    no,
    certain,  ///< as doubles tell, B moved aside
    settled,  ///< wherever points move by the room, too
  };

  /// Whether the plane of the other side's triangle has a side's on one side.
  IST_HD Apart by_plane(int side, const std::uint32_t (&pair)[2]) const {
    exact::Point plane[3];
    load(1 - side, pair[1 - side], plane);
    const auto largest = [](const exact::Point& x) {
      return std::fmax(std::abs(x.x), std::fmax(std::abs(x.y), std::abs(x.z)));
    };
    const double room = memory_.reach[0];
    const double longest =
        std::fmax(largest(plane[1] - plane[0]), largest(plane[2] - plane[0])) + room;
    const MeshBlock& block = in_global_memory(memory_.mesh[side].blocks)[pair[side] / kWidth];
    int sum = 0;
    bool settled = true;
    IST_ROLLED
    for (int k = 0; k < 3; ++k) {
      const exact::Point p =
          memory_.vertex(side, block.vertex[block.corner[k][pair[side] % kWidth]]);
      const exact::Determinant height = height_of<false>(p, plane, side == 1, memory_.aside);
      sum += height.sign;
      // What the room moves: six products of three numbers; moving aside is within the room too.
      const double moved = 12 * room * longest * (2 * largest(p - plane[0]) + longest);
      settled = settled && std::abs(height.value) > height.error + moved;
    }
    if (sum != 3 && sum != -3) return Apart::no;
    return settled ? Apart::settled : Apart::certain;
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
    for (const double six : terms.six_volumes) memory_.add(lane, six);
    memory_.sum[ExactSum::kRounding][lane] += terms.rounding;
    memory_.add(lane, ExactSum::kMoment, terms.moment);
    memory_.add(lane, ExactSum::kPush, terms.force);
    memory_.add(lane, ExactSum::kTurn, terms.torque);
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
  std::uint32_t block_[2] = {0, 0};  ///< whose triangles are met
  int at_ = 0, pairs_ = 0;           ///< pairs of them
  std::uint32_t head_[2] = {0, 0}, queued_[2] = {0, 0};
  std::uint32_t crossings_ = 0, records_ = 0;
};

}  // namespace ist::gpu
