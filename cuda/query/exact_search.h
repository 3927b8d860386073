#pragma once

#include <cmath>
#include <cstdint>

#include "base/team.h"
#include "cuda/base/atomics.h"
#include "cuda/query/exact_boxes.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/exact_pair.h"

namespace ist::gpu {

/// Appends a pair of triangles from each lane that `adds`, in the order of lanes. Pairs beyond the
/// pool's capacity are only counted, so that the next round knows its need.
template <class Team>
IST_HD void append(const Team& team, const ExactPool& pool, ExactChain& chain, bool adds,
                   std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t kPairs = ExactChunk::kPairs;
  const ExactChain before = chain;
  int total = 0;
  const std::uint32_t at =
      before.count + static_cast<std::uint32_t>(team.exclusive_count(adds, total));
  const std::uint32_t end = before.count + static_cast<std::uint32_t>(total);
  const std::uint32_t chunks = (before.count + kPairs - 1) / kPairs;  // so far
  const std::uint32_t last = end > chunks * kPairs ? take(team, pool.taken, 1) : before.last;
  const std::uint32_t to = at < chunks * kPairs ? before.last : last;
  if (adds && to < pool.capacity) {
    std::uint32_t(&slot)[2] = pool.chunks[to].pair[at % kPairs];
    slot[0] = a;
    slot[1] = b;
  }
  team.sync();  // all have read the chain
  if (team.lane() == 0) {
    if (last != before.last && chunks > 0 && before.last < pool.capacity)
      pool.next[before.last] = last;
    chain = {chunks == 0 ? last : before.first, last, end};
  }
  team.sync();
}
/// True if the pool has stored the whole chain.
IST_HD inline bool held(const ExactPool& pool, const ExactChain& chain) {
  return chain.count == 0 || chain.last < pool.capacity;
}

enum class Apart {
  no,
  certain,  ///< by doubles, with B translated symbolically
  settled,  ///< wherever points move within the tolerance, too
};

/// Tests whether the plane of the other side's triangle separates the pair.
IST_HD inline Apart apart_by_plane(const ExactPair& of, int side, const std::uint32_t (&pair)[2]) {
  const std::uint32_t other = side == 0 ? pair[1] : pair[0], one = side == 0 ? pair[0] : pair[1];
  const exact::Point o = of.corner(1 - side, other, 0);
  const exact::Point u = of.corner(1 - side, other, 1) - o, v = of.corner(1 - side, other, 2) - o;
  const double tolerance = of.reach[0];
  const double longest = std::fmax(largest(u), largest(v)) + tolerance;
  const exact::FilteredPlane plane(u, v, (side == 1 ? 1 : -1) * of.aside);
  int sum = 0;
  bool settled = true;
  IST_ROLLED
  for (int k = 0; k < 3; ++k) {
    const exact::Point r = of.corner(side, one, k) - o;
    const exact::Determinant height = plane.height(r);
    sum += height.sign;
    const double moved = moved_height(2 * tolerance, longest,
                                      r);  // the symbolic translation is within the tolerance
    settled = settled && std::abs(height.value) > height.error + moved;
  }
  if (sum != 3 && sum != -3) return Apart::no;
  return settled ? Apart::settled : Apart::certain;
}

/// Tests the next `count` queued pairs of triangles. Keeps those that no plane separates, and those
/// whose signs might differ if points moved within the tolerance. A separate function, since the
/// search needs its registers.
template <class Team>
IST_HD void sift_triangles(const Team& team, const ExactPair& of, ExactSearchMemory& memory,
                           std::uint32_t first, std::uint32_t count) {
  constexpr std::uint32_t kNone = ~0u;
  const auto lane = static_cast<std::uint32_t>(team.lane());
  const bool has = lane < count;
  const std::uint32_t(&slot)[2] = memory.queue[(first + (has ? lane : 0)) % kExactWaiting];
  const std::uint32_t pair[2] = {slot[0], slot[1]};
  Apart apart = has ? Apart::no : Apart::settled;
  IST_ROLLED
  for (int side = 1; side >= 0; --side) {
    if (apart == Apart::settled) break;
    const Apart by = apart_by_plane(of, side, pair);
    if (by > apart) apart = by;
  }
  // Each pair of near blocks is listed once. Blocks of crossing triangles are near anyway; the list
  // of near pairs also decides whether solids may touch.
  const std::uint32_t of_a = apart == Apart::certain ? pair[0] / kWidth : kNone,
                      of_b = pair[1] / kWidth;
  const int leads = lowest_bit(team.alike(of_a) & team.alike(of_b));
  const bool again =
      leads != team.lane() || (memory.last_near[0] == of_a && memory.last_near[1] == of_b);
  team.sync();
  // Pairs of blocks are consecutive, so those of the last lane may continue in the next batch.
  if (lane == Team::kWidth - 1 && of_a != kNone)
    memory.last_near[0] = of_a, memory.last_near[1] = of_b;
  append(team, memory.pool, memory.crossing, apart == Apart::no, pair[0], pair[1]);
  append(team, memory.pool, memory.near, apart == Apart::certain && !again, pair[0], pair[1]);
}

/// A queue of pairs of triangles, which are tested a team's width at a time.
template <class Team>
class WaitingTriangles {
 public:
  IST_HD WaitingTriangles(const Team& team, ExactSearchMemory& memory)
      : team_(team), memory_(memory) {}

  /// Adds a pair from each lane that has one, 16 · block + lane.
  IST_HD void add(bool waits, std::uint32_t a, std::uint32_t b) {
    int total = 0;
    const auto before = static_cast<std::uint32_t>(team_.exclusive_count(waits, total));
    if (waits) {
      std::uint32_t(&slot)[2] = memory_.queue[(head_ + count_ + before) % kExactWaiting];
      slot[0] = a;
      slot[1] = b;
    }
    count_ += static_cast<std::uint32_t>(total);
    team_.sync();
  }

  IST_HD bool is_empty() const { return count_ == 0; }
  IST_HD bool is_full() const { return count_ >= kBatch; }

  /// Calls sift(first, count) for the next pairs of the queue.
  template <class Sift>
  IST_HD bool sift_next(const Sift& sift) {
    const std::uint32_t count = count_ < kBatch ? count_ : kBatch, first = head_;
    head_ = (head_ + count) % kExactWaiting;
    count_ -= count;
    return sift(first, count);
  }

 private:
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static_assert(kExactWaiting >= 2 * kBatch);

  const Team& team_;
  ExactSearchMemory& memory_;
  std::uint32_t head_ = 0, count_ = 0;
};

template <class Team>
IST_HD void begin_sifting(const Team& team, ExactSearchMemory& memory, const ExactPool& pool) {
  if (team.lane() != 0) return;
  memory.pool = pool;
  memory.crossing = memory.near = {};
  memory.last_near[0] = memory.last_near[1] = ~0u;
}

/// Finds pairs of triangles of two meshes that may cross. Both trees are traversed together, depth
/// first. If the boxes and slabs of two blocks intersect, pairs of triangles whose boxes intersect
/// and that no plane separates in float are queued for the tests in double.
template <class Team, class Pair = ExactPair>
class ExactSearch {
 public:
  /// `waiting`: memory for pending pairs of nodes.
  IST_HD ExactSearch(const Team& team, const Pair& pair, ExactSearchMemory& memory,
                     std::uint64_t* waiting, std::uint32_t most_waiting, const ExactPool& pool)
      : team_(team),
        pair_(pair),
        boxes_(pair),
        memory_(memory),
        queue_(team, memory),
        waiting_(waiting),
        most_waiting_(most_waiting) {
    for (auto k = static_cast<std::uint32_t>(team_.lane()); k <= kWidth; k += kBatch)
      memory_.inverse[k] = k == 0 ? 0 : (0xFFFFu + k) / k;
    begin_sifting(team_, memory_, pool);
    if (team_.lane() == 0)
      waiting_[0] = pair_of(MeshNode::at(pair_.mesh[0].top, 0), MeshNode::at(pair_.mesh[1].top, 0));
  }

  /// Calls sift(first, count) for queued pairs of triangles. False if sift() returned false or if
  /// the memory for pending nodes is full.
  template <class Sift>
  IST_HD bool run(const Sift& sift) {
    while (count_ > 0) {
      if (!open()) return false;
      for (std::uint32_t next = 0; next < found_; ++next) {
        const std::uint32_t found = memory_.found[next];
        const std::uint32_t left = place_blocks(found / kWidth, found % kWidth);
        if (left == 0) continue;
        const int met = meet_triangles(static_cast<int>(left % 256), static_cast<int>(left / 256));
        for (int first = 0; first < met; first += Team::kWidth) {
          test_planes(first, met);
          if (queue_.is_full() && !queue_.sift_next(sift)) return false;
        }
      }
    }
    return queue_.is_empty() || queue_.sift_next(sift);
  }

  std::uint32_t visits = 0;  ///< pairs of nodes opened

 private:
  using Boxes = ExactBoxes<Pair>;
  using Box = typename Boxes::Box;
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static constexpr int kBoth = 2 * static_cast<int>(kWidth);

  IST_HD static std::uint64_t pair_of(MeshNode a, MeshNode b) {
    return std::uint64_t{a.word} << 32 | b.word;
  }

  /// Numbers the pairs of two lists row by row.
  struct Pairs {
    std::uint32_t columns, inverse;
    IST_HD std::uint32_t row(std::uint32_t k) const { return k * inverse >> 16; }
  };

  IST_HD Pairs pairs_of(int columns) const {
    return {static_cast<std::uint32_t>(columns), memory_.inverse[columns]};
  }

  IST_HD bool open() {
    team_.sync();
    const std::uint64_t waiting = waiting_[--count_];
    node_[0] = {static_cast<std::uint32_t>(waiting >> 32)};
    node_[1] = {static_cast<std::uint32_t>(waiting)};
    ++visits;
    const int level[2] = {node_[0].level(), node_[1].level()};
    boxes_.open(node_, opens_);
    team_.sync();
    int of_a = 0, of_b = 0;
    for (int first = 0; first < kBoth; first += Team::kWidth) {
      const int k = first + team_.lane(), side = k / static_cast<int>(kWidth);
      const auto l = static_cast<std::uint32_t>(k) % kWidth;
      Box box = {};
      const bool meets = place_child(side, l, box);
      const int at = listed(meets, side, of_a, of_b);
      if (meets) boxes_.keep(side, child_of(side, l), l, box, memory_.boxes[side][at]);
    }
    team_.sync();
    found_ = 0;
    const bool leaves =
        level[0] == static_cast<int>(opens_[0]) && level[1] == static_cast<int>(opens_[1]);
    const Pairs of = pairs_of(of_b);
    const int pairs = of_a * of_b;
    for (int first = 0; first < pairs; first += Team::kWidth) {
      const int k = first + team_.lane();
      const std::uint32_t i = k < pairs ? of.row(static_cast<std::uint32_t>(k)) : 0,
                          j = k < pairs ? static_cast<std::uint32_t>(k) - i * of.columns : 0;
      const bool meets = k < pairs && boxes_.meet(memory_.boxes[0][i], memory_.boxes[1][j]);
      int total = 0;
      const auto before = static_cast<std::uint32_t>(team_.exclusive_count(meets, total));
      if (leaves) {
        if (meets) memory_.found[found_ + before] = static_cast<std::uint8_t>(kWidth * i + j);
        found_ += static_cast<std::uint32_t>(total);
        continue;
      }
      if (count_ + static_cast<std::uint32_t>(total) > most_waiting_) return false;
      if (meets) waiting_[count_ + before] = pair_of(child(0, i), child(1, j));
      count_ += static_cast<std::uint32_t>(total);
    }
    team_.sync();
    return true;
  }

  /// The child of a side's node whose box is the i-th in the list, or the node itself.
  IST_HD MeshNode child(int side, std::uint32_t i) const {
    const MeshNode of = node_[side];
    return opens_[side]
               ? MeshNode::at(of.level() - 1, kWidth * of.number() + memory_.boxes[side][i].lane)
               : of;
  }

  /// The position of a lane's item in the list of its side. `of_a`, `of_b`: the lists' lengths.
  IST_HD int listed(bool adds, int side, int& of_a, int& of_b) const {
    int more_a = 0, more_b = 0;
    const int before_a = of_a + team_.exclusive_count(adds && side == 0, more_a);
    const int before_b = of_b + team_.exclusive_count(adds && side == 1, more_b);
    of_a += more_a;
    of_b += more_b;
    return side == 0 ? before_a : before_b;
  }

  // Arrays must not be indexed differently by lanes: they would be in slow memory.
  IST_HD MeshNode node_of(int side) const { return side == 0 ? node_[0] : node_[1]; }
  IST_HD bool opened(int side) const { return side == 0 ? opens_[0] : opens_[1]; }

  /// Places the l-th child of a side's node, or the node itself as child 0. True if it exists and
  /// its box intersects that of the other side's node.
  IST_HD bool place_child(int side, std::uint32_t l, Box& box) const {
    const MeshNode node = child_of(side, l);
    if (opened(side) ? node.number() >= pair_.mesh[side].level[node.level()].count : l > 0)
      return false;
    return boxes_.place_child(side, node, node_of(1 - side), box);
  }
  IST_HD MeshNode child_of(int side, std::uint32_t l) const {
    const MeshNode node = node_of(side);
    return opened(side) ? MeshNode::at(node.level() - 1, kWidth * node.number() + l) : node;
  }

  /// Places the triangles of two blocks whose boxes intersect the other block's. Returns their
  /// number in A plus 256 times that in B; 0 if a side has none.
  IST_HD std::uint32_t place_blocks(std::uint32_t i, std::uint32_t j) {
    block_[0] = child(0, i).number();
    block_[1] = child(1, j).number();
    for (int k = team_.lane(); k < kBoth; k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth), v = k % static_cast<int>(kWidth);
      const FloatBlock& block = float_block(side);
      float at[3] = {block.x[0][v], block.x[1][v], block.x[2][v]};
      boxes_.place_vertex(side, at);
      for (int axis = 0; axis < 3; ++axis) memory_.vertices[axis][side][v] = at[axis];
    }
    team_.sync();
    int of_a = 0, of_b = 0;
    for (int first = 0; first < kBoth; first += Team::kWidth) {
      const int k = first + team_.lane(), side = k / static_cast<int>(kWidth);
      const auto t = static_cast<std::uint32_t>(k) % kWidth;
      const std::uint32_t corners = float_block(side).corner[t];
      float p[3], q[3], r[3];
      vertex(side, corners, p);
      vertex(side, corners >> 8, q);
      vertex(side, corners >> 16, r);
      const Quad by_low = side == 0 ? memory_.boxes[1][j].other_low : memory_.boxes[0][i].low,
                 by_high = side == 0 ? memory_.boxes[1][j].other_high : memory_.boxes[0][i].high;
      const float slack = boxes_.slack(), wider = side == 0 ? slack : 0;
      ExactTriangle out;
      bool meets = corners >> 24 != 0;
      for (int axis = 0; axis < 3; ++axis) {
        const float low = std::fmin(p[axis], std::fmin(q[axis], r[axis]));
        const float high = std::fmax(p[axis], std::fmax(q[axis], r[axis]));
        meets = meets && low - slack <= by_high.x[axis] && high + slack >= by_low.x[axis];
        out.low.x[axis] = low - wider;
        out.high.x[axis] = high + wider;
      }
      // Most pairs of blocks are rejected here.
      const std::uint32_t lanes = team_.ballot(meets);
      if (Team::kWidth == kBoth && (lanes >> kWidth == 0 || lanes << kWidth == 0)) break;
      // Boxes of both sides include how far their points may move.
      float ahead = 0;
      if constexpr (Boxes::kAhead)
        ahead = side == 0 ? memory_.boxes[1][j].normal.x[3] : memory_.boxes[0][i].normal.x[3];
      boxes_.place_plane(p, q, r, by_low, by_high, ahead, out);
      out.call(t | corners << 8);
      const int at = listed(meets, side, of_a, of_b);
      if (meets) {
        ExactTriangle& to = memory_.triangles[side][at];
        to.low = out.low;
        to.high = out.high;
        to.plane = out.plane;
      }
    }
    team_.sync();
    return of_a == 0 || of_b == 0 ? 0 : static_cast<std::uint32_t>(of_a + 256 * of_b);
  }

  IST_HD const FloatBlock& float_block(int side) const {
    return in_global_memory(pair_.in_floats[side])[side == 0 ? block_[0] : block_[1]];
  }
  /// The vertex of a block that the last byte of `name` selects.
  IST_HD void vertex(int side, std::uint32_t name, float (&out)[3]) const {
    for (int k = 0; k < 3; ++k) out[k] = memory_.vertices[k][side][name & 0xFF];
  }

  /// Lists the pairs of triangles whose boxes intersect, and returns their number.
  IST_HD int meet_triangles(int rows, int columns) {
    const Pairs of = pairs_of(columns);
    const int pairs = rows * columns;
    int met = 0;
    for (int first = 0; first < pairs; first += Team::kWidth) {
      const int k = first + team_.lane();
      const std::uint32_t i = k < pairs ? of.row(static_cast<std::uint32_t>(k)) : 0,
                          j = k < pairs ? static_cast<std::uint32_t>(k) - i * of.columns : 0;
      const Quad a_low = memory_.triangles[0][i].low, a_high = memory_.triangles[0][i].high,
                 b_low = memory_.triangles[1][j].low, b_high = memory_.triangles[1][j].high;
      bool meets = k < pairs;
      for (int axis = 0; axis < 3; ++axis)
        meets = meets && a_low.x[axis] <= b_high.x[axis] && a_high.x[axis] >= b_low.x[axis];
      int total = 0;
      const int before = team_.exclusive_count(meets, total);
      if (meets) memory_.met[met + before] = static_cast<std::uint8_t>(kWidth * i + j);
      met += total;
    }
    team_.sync();
    return met;
  }

  /// Queues those of the listed pairs that no plane separates in float.
  IST_HD void test_planes(int first, int met) {
    const int k = first + team_.lane();
    const std::uint32_t pair = memory_.met[k < met ? k : first];
    const ExactTriangle &a = memory_.triangles[0][pair / kWidth],
                        &b = memory_.triangles[1][pair % kWidth];
    const bool waits = k < met && !apart_by(a, b.name(), 1) && !apart_by(b, a.name(), 0);
    queue_.add(waits, kWidth * block_[0] + a.name() % kWidth,
               kWidth * block_[1] + b.name() % kWidth);
  }

  /// True if a triangle's plane has a triangle of the given side certainly on one side.
  IST_HD bool apart_by(const ExactTriangle& plane, std::uint32_t name, int side) const {
    return Boxes::apart_by(plane,
                           [&](int k, float(&x)[3]) { vertex(side, name >> (8 + 8 * k), x); });
  }

  const Team& team_;
  const Pair& pair_;
  const Boxes boxes_;
  ExactSearchMemory& memory_;
  WaitingTriangles<Team> queue_;
  std::uint64_t* const waiting_;
  const std::uint32_t most_waiting_;
  MeshNode node_[2] = {};            ///< the opened pair
  bool opens_[2] = {false, false};   ///< sides whose children are visited
  std::uint32_t count_ = 1;          ///< pending pairs of nodes
  std::uint32_t found_ = 0;          ///< pairs of blocks found
  std::uint32_t block_[2] = {0, 0};  ///< the blocks whose triangles are tested
};

}  // namespace ist::gpu
