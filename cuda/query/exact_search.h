#pragma once

#include <cmath>
#include <cstdint>

#include "base/team.h"
#include "cuda/base/atomics.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/exact_pair.h"

namespace ist::gpu {

/// Appends a pair of triangles of each lane that `adds`, in their order. Beyond the pool's room
/// they are only counted, so that the next round knows what it takes.
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
  if (adds && to < pool.room) {
    std::uint32_t(&slot)[2] = pool.chunks[to].pair[at % kPairs];
    slot[0] = a;
    slot[1] = b;
  }
  team.sync();  // all have read the chain
  if (team.lane() == 0) {
    if (last != before.last && chunks > 0 && before.last < pool.room) pool.next[before.last] = last;
    chain = {chunks == 0 ? last : before.first, last, end};
  }
  team.sync();
}
/// Whether the pool had room for all of it.
IST_HD inline bool held(const ExactPool& pool, const ExactChain& chain) {
  return chain.count == 0 || chain.last < pool.room;
}

enum class Apart {
  no,
  certain,  ///< as doubles tell, B moved aside
  settled,  ///< wherever points move by the room, too
};

/// Whether the plane of the other side's triangle has a side's on one side.
IST_HD inline Apart apart_by_plane(const ExactPair& of, int side, const std::uint32_t (&pair)[2]) {
  const std::uint32_t other = side == 0 ? pair[1] : pair[0], one = side == 0 ? pair[0] : pair[1];
  const exact::Point o = of.corner(1 - side, other, 0);
  const exact::Point u = of.corner(1 - side, other, 1) - o, v = of.corner(1 - side, other, 2) - o;
  const double room = of.reach[0];
  const double longest = std::fmax(largest(u), largest(v)) + room;
  const exact::FilteredPlane plane(u, v, (side == 1 ? 1 : -1) * of.aside);
  int sum = 0;
  bool settled = true;
  IST_ROLLED
  for (int k = 0; k < 3; ++k) {
    const exact::Point r = of.corner(side, one, k) - o;
    const exact::Determinant height = plane.height(r);
    sum += height.sign;
    const double moved = moved_height(2 * room, longest, r);  // moving aside is within the room
    settled = settled && std::abs(height.value) > height.error + moved;
  }
  if (sum != 3 && sum != -3) return Apart::no;
  return settled ? Apart::settled : Apart::certain;
}

/// Of the next so many pairs of triangles that wait keeps those that no plane keeps apart, and
/// those whose signs might differ if points moved by the room. A function of its own: the search
/// needs its registers.
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
  // Blocks that are near once. Those of pairs that may cross are near anyway, but that these are
  // not settled tells whether solids may touch.
  const std::uint32_t of_a = apart == Apart::certain ? pair[0] / kWidth : kNone,
                      of_b = pair[1] / kWidth;
  const int leads = lowest_bit(team.alike(of_a) & team.alike(of_b));
  const bool again =
      leads != team.lane() || (memory.last_near[0] == of_a && memory.last_near[1] == of_b);
  team.sync();
  // Pairs of blocks follow each other: those of the last lane come first in the next batch.
  if (lane == Team::kWidth - 1 && of_a != kNone)
    memory.last_near[0] = of_a, memory.last_near[1] = of_b;
  append(team, memory.pool, memory.crossing, apart == Apart::no, pair[0], pair[1]);
  append(team, memory.pool, memory.near, apart == Apart::certain && !again, pair[0], pair[1]);
}

/// Pairs of triangles of both meshes that may cross. Both trees are opened together, depth first;
/// of pairs of blocks whose boxes and slabs meet the pairs of triangles whose boxes meet, and that
/// no plane keeps apart in floats, wait until a team's width of them can be sifted.
template <class Team>
class ExactSearch {
 public:
  /// `waiting`: room for pairs of nodes.
  IST_HD ExactSearch(const Team& team, const ExactPair& pair, ExactSearchMemory& memory,
                     std::uint64_t* waiting, std::uint32_t most_waiting, const ExactPool& pool)
      : team_(team), pair_(pair), memory_(memory), waiting_(waiting), most_waiting_(most_waiting) {
    for (auto k = static_cast<std::uint32_t>(team_.lane()); k <= kWidth; k += kBatch)
      memory_.inverse[k] = k == 0 ? 0 : (0xFFFFu + k) / k;
    if (team_.lane() == 0) {
      memory_.pool = pool;
      memory_.crossing = memory_.near = {};
      memory_.last_near[0] = memory_.last_near[1] = ~0u;
      waiting_[0] = pair_of(MeshNode::at(pair_.mesh[0].top, 0), MeshNode::at(pair_.mesh[1].top, 0));
    }
  }

  /// Calls sift(first, count) of pairs of triangles that wait. False where that says so, or where
  /// the memory does not hold the nodes that wait.
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
          if (queued_ >= kBatch && !sift_next(sift)) return false;
        }
      }
    }
    return queued_ == 0 || sift_next(sift);
  }

  std::uint32_t visits = 0;  ///< pairs of nodes opened

 private:
  static constexpr float kError = 4e-7f;  ///< relative, of a few operations
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static constexpr int kBoth = 2 * static_cast<int>(kWidth);
  static_assert(kExactWaiting >= 2 * kBatch);

  IST_HD static std::uint64_t pair_of(MeshNode a, MeshNode b) {
    return std::uint64_t{a.word} << 32 | b.word;
  }

  /// Numbers two lists' pairs row by row.
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
    // Nodes tile a surface: squares of their sizes, times both counts.
    const auto scale = static_cast<float>(pair_.place.a_from_b.scale);
    const float size[2] = {static_cast<float>(pair_.mesh[1].level[level[1]].count),
                           scale * scale * static_cast<float>(pair_.mesh[0].level[level[0]].count)};
    constexpr float kAlone = kOpenedAlone * kOpenedAlone;
    opens_[0] = level[0] > 0 && (level[1] == 0 || size[1] <= kAlone * size[0]);
    opens_[1] = level[1] > 0 && (level[0] == 0 || size[0] <= kAlone * size[1]);
    team_.sync();
    int of_a = 0, of_b = 0;
    for (int first = 0; first < kBoth; first += Team::kWidth) {
      const int k = first + team_.lane(), side = k / static_cast<int>(kWidth);
      const auto l = static_cast<std::uint32_t>(k) % kWidth;
      Box box = {};
      const bool meets = place_child(side, l, box);
      const int at = listed(meets, side, of_a, of_b);
      if (meets) keep(side, l, box, memory_.boxes[side][at]);
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
      const bool meets = k < pairs && meet(memory_.boxes[0][i], memory_.boxes[1][j]);
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

  /// Of the node of a side the child whose box is the i-th, or the node itself.
  IST_HD MeshNode child(int side, std::uint32_t i) const {
    const MeshNode of = node_[side];
    return opens_[side]
               ? MeshNode::at(of.level() - 1, kWidth * of.number() + memory_.boxes[side][i].lane)
               : of;
  }

  /// A node's box in its own frame and, with what rounding does, in the other's.
  struct Box {
    float low[3], high[3], other_low[3], other_high[3];
  };
  IST_HD void place(int side, int level, std::uint32_t n, Box& box) const {
    const MeshTree& mesh = pair_.mesh[side];
    if (level == mesh.top) {
      for (int k = 0; k < 3; ++k) box.low[k] = mesh.low[k], box.high[k] = mesh.high[k];
    } else {
      const BoxBlock& from = in_global_memory(mesh.level[level + 1].boxes)[n / kWidth];
      for (int k = 0; k < 3; ++k) {
        box.low[k] = from.low[k][n % kWidth];
        box.high[k] = from.high[k][n % kWidth];
      }
    }
    float middle[3], half[3];
    for (int k = 0; k < 3; ++k) {
      middle[k] = 0.5f * (box.low[k] + box.high[k]);
      half[k] = 0.5f * (box.high[k] - box.low[k]);
    }
    const float pad = pair_.pad[side];
    for (int k = 0; k < 3; ++k) {
      const Quad m = pair_.row[side][k];
      const float c = std::fma(m.x[0], middle[0],
                               std::fma(m.x[1], middle[1], std::fma(m.x[2], middle[2], m.x[3])));
      const float h = std::fma(std::abs(m.x[0]), half[0],
                               std::fma(std::abs(m.x[1]), half[1], std::abs(m.x[2]) * half[2]));
      const float around = std::fma(1 + kError, h, pad);
      box.other_low[k] = c - around;
      box.other_high[k] = c + around;
    }
  }

  /// Place of a lane's item in the list of its side, of which there are so many before.
  IST_HD int listed(bool adds, int side, int& of_a, int& of_b) const {
    int more_a = 0, more_b = 0;
    const int before_a = of_a + team_.exclusive_count(adds && side == 0, more_a);
    const int before_b = of_b + team_.exclusive_count(adds && side == 1, more_b);
    of_a += more_a;
    of_b += more_b;
    return side == 0 ? before_a : before_b;
  }

  // No array is indexed by what lanes differ in: it would lie in memory that is slow.
  IST_HD MeshNode node_of(int side) const { return side == 0 ? node_[0] : node_[1]; }
  IST_HD bool opened(int side) const { return side == 0 ? opens_[0] : opens_[1]; }

  /// Of a side's node the l-th child, or the node alone as the first; whether there is one, and
  /// its box meets that of the other side's node.
  IST_HD bool place_child(int side, std::uint32_t l, Box& box) const {
    const MeshNode node = child_of(side, l), other = node_of(1 - side);
    if (opened(side) ? node.number() >= pair_.mesh[side].level[node.level()].count : l > 0)
      return false;
    Box by;
    place(side, node.level(), node.number(), box);
    place(1 - side, other.level(), other.number(), by);
    const float reach = pair_.reach[side], by_reach = pair_.reach[1 - side];
    bool meets = true;
    for (int k = 0; k < 3; ++k) {
      box.low[k] -= reach;
      box.high[k] += reach;
      meets = meets && box.low[k] <= by.other_high[k] && box.high[k] >= by.other_low[k] &&
              by.low[k] - by_reach <= box.other_high[k] &&
              by.high[k] + by_reach >= box.other_low[k];
    }
    return meets;
  }
  IST_HD MeshNode child_of(int side, std::uint32_t l) const {
    const MeshNode node = node_of(side);
    return opened(side) ? MeshNode::at(node.level() - 1, kWidth * node.number() + l) : node;
  }

  IST_HD void keep(int side, std::uint32_t l, const Box& box, ExactBox& out) const {
    const MeshNode node = child_of(side, l);
    const int level = node.level();
    const std::uint32_t n = node.number();
    float normal[3] = {0, 0, 0}, low = -kFar, high = kFar;
    if (level < pair_.mesh[side].top) {
      const BoxBlock& from = in_global_memory(pair_.mesh[side].level[level + 1].boxes)[n / kWidth];
      for (int k = 0; k < 3; ++k) normal[k] = from.normal[k][n % kWidth];
      low = from.slab_low[n % kWidth], high = from.slab_high[n % kWidth];
    }
    const auto scale = static_cast<float>(pair_.place.a_from_b.scale);
    float shift = 0, turned[3], reach[3];
    for (int k = 0; k < 3; ++k) {
      const Quad m = pair_.turn[side][k];
      turned[k] = std::fma(m.x[0], normal[0], std::fma(m.x[1], normal[1], m.x[2] * normal[2]));
      shift = std::fma(turned[k], pair_.row[1][k].x[3], shift);
      reach[k] = scale * (std::abs(turned[k]) + kError);
    }
    if (side == 1) {
      for (int k = 0; k < 3; ++k) normal[k] = turned[k];
      low = scale * low + shift - 2 * pair_.pad[1];
      high = scale * high + shift + 2 * pair_.pad[1];
    }
    out.low = {{box.low[0], box.low[1], box.low[2], low}};
    out.high = {{box.high[0], box.high[1], box.high[2], high}};
    out.other_low = {{box.other_low[0], box.other_low[1], box.other_low[2], 0}};
    out.other_high = {{box.other_high[0], box.other_high[1], box.other_high[2], 0}};
    out.normal = {{normal[0], normal[1], normal[2], 0}};
    out.turned = {{reach[0], reach[1], reach[2], 0}};
    out.lane = l;
  }
  static constexpr float kFar = 3e38f;  ///< beyond any slab

  IST_HD bool meet(const ExactBox& a, const ExactBox& b) const {
    const Quad a_low = a.low, a_high = a.high, b_at = b.other_low, b_to = b.other_high;
    bool meets = true;
    for (int k = 0; k < 3; ++k)
      meets = meets && a_low.x[k] <= b_to.x[k] && a_high.x[k] >= b_at.x[k];
    if (!meets) return false;
    const Quad b_low = b.low, b_high = b.high, a_at = a.other_low, a_to = a.other_high;
    for (int k = 0; k < 3; ++k)
      meets = meets && b_low.x[k] <= a_to.x[k] && b_high.x[k] >= a_at.x[k];
    if (!meets) return false;
    // Whether each reaches into the other's slab.
    const Quad normal = a.normal, turned = a.turned, normal_b = b.normal;
    float along = 0, reach = pair_.slack, along_b = 0, reach_b = pair_.slack;
    for (int k = 0; k < 3; ++k) {
      along = std::fma(normal.x[k], 0.5f * (b_at.x[k] + b_to.x[k]), along);
      reach = std::fma(turned.x[k], 0.5f * (b_high.x[k] - b_low.x[k]), reach);
      along_b = std::fma(normal_b.x[k], 0.5f * (a_low.x[k] + a_high.x[k]), along_b);
      reach_b = std::fma(std::abs(normal_b.x[k]), 0.5f * (a_high.x[k] - a_low.x[k]), reach_b);
    }
    return along - reach <= a_high.x[3] && along + reach >= a_low.x[3] &&
           along_b - reach_b <= b_high.x[3] && along_b + reach_b >= b_low.x[3];
  }

  /// Of two blocks the triangles whose boxes meet that of the other; of A's how many, and
  /// 256 · of B's; 0: of a side none.
  IST_HD std::uint32_t place_blocks(std::uint32_t i, std::uint32_t j) {
    block_[0] = child(0, i).number();
    block_[1] = child(1, j).number();
    for (int k = team_.lane(); k < kBoth; k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth), v = k % static_cast<int>(kWidth);
      const FloatBlock& block = float_block(side);
      float at[3] = {block.x[0][v], block.x[1][v], block.x[2][v]};
      if (side == 1) {
        const float own[3] = {at[0], at[1], at[2]};
        for (int axis = 0; axis < 3; ++axis) {
          const Quad m = pair_.row[1][axis];
          at[axis] =
              std::fma(m.x[0], own[0], std::fma(m.x[1], own[1], std::fma(m.x[2], own[2], m.x[3])));
        }
      }
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
      const float slack = pair_.slack, wider = side == 0 ? slack : 0;
      ExactTriangle out;
      bool meets = corners >> 24 != 0;
      for (int axis = 0; axis < 3; ++axis) {
        const float low = std::fmin(p[axis], std::fmin(q[axis], r[axis]));
        const float high = std::fmax(p[axis], std::fmax(q[axis], r[axis]));
        meets = meets && low - slack <= by_high.x[axis] && high + slack >= by_low.x[axis];
        out.low.x[axis] = low - wider;
        out.high.x[axis] = high + wider;
      }
      // Most pairs of blocks end here.
      const std::uint32_t lanes = team_.ballot(meets);
      if (Team::kWidth == kBoth && (lanes >> kWidth == 0 || lanes << kWidth == 0)) break;
      place_plane(p, q, r, by_low, by_high, out);
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
  /// The vertex of a block that the last byte names.
  IST_HD void vertex(int side, std::uint32_t name, float (&out)[3]) const {
    for (int k = 0; k < 3; ++k) out[k] = memory_.vertices[k][side][name & 0xFF];
  }

  /// A triangle's plane, for heights of points of a box.
  IST_HD void place_plane(const float (&p)[3], const float (&q)[3], const float (&r)[3],
                          const Quad& low, const Quad& high, ExactTriangle& out) const {
    float u[3], v[3], longest = 0, farthest = 0;
    for (int k = 0; k < 3; ++k) {
      u[k] = q[k] - p[k];
      v[k] = r[k] - p[k];
      longest = std::fmax(longest, std::fmax(std::abs(u[k]), std::abs(v[k])));
      farthest = std::fmax(farthest, std::fmax(high.x[k] - p[k], p[k] - low.x[k]));
    }
    Quad& n = out.plane;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      n.x[k] = std::fma(u[l], v[m], -(u[m] * v[l]));
    }
    n.x[3] = -std::fma(n.x[0], p[0], std::fma(n.x[1], p[1], n.x[2] * p[2]));
    // What moves points, as in by_plane(), and places them in floats; and what floats round.
    const float moved = 0.5f * pair_.slack;
    longest += moved;
    farthest += moved;
    out.margin() = longest * (12 * moved * (2 * farthest + longest) + 4e-6f * longest * farthest);
  }

  /// Their pairs of triangles whose boxes meet: how many.
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

  /// Of so many of these what no plane keeps apart, as floats tell, waits.
  IST_HD void test_planes(int first, int met) {
    const int k = first + team_.lane();
    const std::uint32_t pair = memory_.met[k < met ? k : first];
    const ExactTriangle &a = memory_.triangles[0][pair / kWidth],
                        &b = memory_.triangles[1][pair % kWidth];
    const bool waits = k < met && !apart_by(a, b.name(), 1) && !apart_by(b, a.name(), 0);
    int total = 0;
    const auto before = static_cast<std::uint32_t>(team_.exclusive_count(waits, total));
    if (waits) {
      std::uint32_t(&slot)[2] = memory_.queue[(head_ + queued_ + before) % kExactWaiting];
      slot[0] = kWidth * block_[0] + a.name() % kWidth;
      slot[1] = kWidth * block_[1] + b.name() % kWidth;
    }
    queued_ += static_cast<std::uint32_t>(total);
    team_.sync();
  }

  /// The next that wait.
  template <class Sift>
  IST_HD bool sift_next(const Sift& sift) {
    const std::uint32_t count = queued_ < kBatch ? queued_ : kBatch, first = head_;
    head_ = (head_ + count) % kExactWaiting;
    queued_ -= count;
    return sift(first, count);
  }

  /// Whether a triangle's plane has another, of a side, on one side for certain.
  IST_HD bool apart_by(const ExactTriangle& plane, std::uint32_t name, int side) const {
    const Quad n = plane.plane;
    float least = kFar, most = -kFar;
    for (int k = 0; k < 3; ++k) {
      float x[3];
      vertex(side, name >> (8 + 8 * k), x);
      const float height =
          std::fma(n.x[0], x[0], std::fma(n.x[1], x[1], std::fma(n.x[2], x[2], n.x[3])));
      least = std::fmin(least, height);
      most = std::fmax(most, height);
    }
    return least > plane.margin() || most < -plane.margin();
  }

  const Team& team_;
  const ExactPair& pair_;
  ExactSearchMemory& memory_;
  std::uint64_t* const waiting_;
  const std::uint32_t most_waiting_;
  MeshNode node_[2] = {};            ///< that are opened
  bool opens_[2] = {false, false};   ///< whose children are looked at
  std::uint32_t count_ = 1;          ///< that wait
  std::uint32_t found_ = 0;          ///< pairs of blocks
  std::uint32_t block_[2] = {0, 0};  ///< whose triangles are met
  std::uint32_t head_ = 0, queued_ = 0;
};

}  // namespace ist::gpu
