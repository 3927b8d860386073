#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/exact_pair.h"
#include "numerics/team.h"

namespace ist::gpu {

/// Appends a pair of triangles of each lane that `adds`, in their order; false: no room.
template <class Team>
IST_HD bool append(const Team& team, const ExactPool& pool, ExactChain& chain, bool adds,
                   std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t kPairs = ExactChunk::kPairs;
  int total = 0;
  const std::uint32_t at =
      chain.count + static_cast<std::uint32_t>(team.exclusive_count(adds, total));
  const std::uint32_t end = chain.count + static_cast<std::uint32_t>(total);
  const std::uint32_t chunks = (chain.count + kPairs - 1) / kPairs;  // so far
  std::uint32_t last = chain.last;
  if (end > chunks * kPairs) {
    last = take(team, pool.taken, 1);
    if (last >= pool.room) return false;
    if (chunks == 0)
      chain.first = last;
    else if (team.lane() == 0)
      pool.next[chain.last] = last;
  }
  if (adds) {
    std::uint32_t(&slot)[2] =
        pool.chunks[at < chunks * kPairs ? chain.last : last].pair[at % kPairs];
    slot[0] = a;
    slot[1] = b;
  }
  chain.last = last;
  chain.count = end;
  return true;
}

/// Pairs of triangles of both meshes that may cross. Both trees are opened together, depth first;
/// of pairs of blocks whose boxes and slabs meet the pairs of triangles whose boxes meet wait until
/// a team's width of them can be sifted.
template <class Team>
class ExactSearch {
 public:
  /// `waiting`: room for pairs of nodes.
  IST_HD ExactSearch(const Team& team, const ExactPair& pair, ExactSearchMemory& memory,
                     std::uint64_t* waiting, std::uint32_t most_waiting, const ExactPool& pool)
      : team_(team),
        pair_(pair),
        memory_(memory),
        waiting_(waiting),
        most_waiting_(most_waiting),
        pool_(pool) {}

  /// False where the memory does not hold it.
  IST_HD bool run() {
    if (team_.lane() == 0)
      waiting_[0] = pair_of(MeshNode::at(pair_.mesh[0].top, 0), MeshNode::at(pair_.mesh[1].top, 0));
    count_ = 1;
    // All in one loop: the code of each step is there once.
    std::uint32_t next = 0;  // of the pairs of blocks found
    for (;;) {
      const bool last = count_ == 0 && next == found_ && at_ >= pairs_ && tested_ >= met_;
      if (queued_ >= kBatch || (last && queued_ > 0)) {
        if (!sift()) return false;
      } else if (at_ < pairs_) {
        meet_triangles();
      } else if (tested_ < met_) {
        test_planes();
      } else if (next < found_) {
        const std::uint32_t found = memory_.found[next++];
        place_blocks(found / kWidth, found % kWidth);
      } else if (count_ > 0) {
        next = 0;
        if (!open()) return false;
      } else {
        return true;
      }
    }
  }

  ExactChain crossing = {}, near = {};
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
    IST_HD explicit Pairs(int count) : columns(static_cast<std::uint32_t>(count)) {
      inverse = (0xFFFFu + columns) / (columns | static_cast<std::uint32_t>(columns == 0));
    }
    IST_HD std::uint32_t row(std::uint32_t k) const { return k * inverse >> 16; }
  };

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
    int left[2] = {0, 0};
    for (int first = 0; first < kBoth; first += Team::kWidth) {
      const int k = first + team_.lane(), side = k / static_cast<int>(kWidth);
      const auto l = static_cast<std::uint32_t>(k) % kWidth;
      ExactBox box;
      const bool meets = place_child(side, l, box);
      for (int s = 0; s < 2; ++s) {
        int total = 0;
        const bool mine = meets && side == s;
        const int at = left[s] + team_.exclusive_count(mine, total);
        if (mine) {
          memory_.boxes[s][at] = box;
          memory_.lane[s][at] = static_cast<std::uint8_t>(l);
        }
        left[s] += total;
      }
    }
    team_.sync();
    found_ = 0;
    const bool leaves =
        level[0] == static_cast<int>(opens_[0]) && level[1] == static_cast<int>(opens_[1]);
    const Pairs of(left[1]);
    const int pairs = left[0] * left[1];
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
    return opens_[side] ? MeshNode::at(of.level() - 1, kWidth * of.number() + memory_.lane[side][i])
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

  /// Of a side's node the l-th child, or the node alone as the first; whether there is one, and
  /// its box meets that of the other side's node.
  IST_HD bool place_child(int side, std::uint32_t l, ExactBox& out) const {
    // No array is indexed by what lanes differ in: it would lie in memory.
    const MeshNode node = side == 0 ? node_[0] : node_[1], other = side == 0 ? node_[1] : node_[0];
    const bool opened = side == 0 ? opens_[0] : opens_[1];
    const int level = opened ? node.level() - 1 : node.level();
    const std::uint32_t n = opened ? kWidth * node.number() + l : node.number();
    if (opened ? n >= pair_.mesh[side].level[level].count : l > 0) return false;
    Box box, by;
    place(side, level, n, box);
    place(1 - side, other.level(), other.number(), by);
    const float reach = pair_.reach[side], by_reach = pair_.reach[1 - side];
    bool meets = true;
    for (int k = 0; k < 3; ++k) {
      out.low.x[k] = box.low[k] - reach;
      out.high.x[k] = box.high[k] + reach;
      out.other_low.x[k] = box.other_low[k];
      out.other_high.x[k] = box.other_high[k];
      meets = meets && out.low.x[k] <= by.other_high[k] && out.high.x[k] >= by.other_low[k] &&
              by.low[k] - by_reach <= box.other_high[k] &&
              by.high[k] + by_reach >= box.other_low[k];
    }
    if (!meets) return false;
    float normal[3] = {0, 0, 0}, low = -kFar, high = kFar;
    if (level < pair_.mesh[side].top) {
      const BoxBlock& from = in_global_memory(pair_.mesh[side].level[level + 1].boxes)[n / kWidth];
      for (int k = 0; k < 3; ++k) normal[k] = from.normal[k][n % kWidth];
      low = from.slab_low[n % kWidth], high = from.slab_high[n % kWidth];
    }
    const auto scale = static_cast<float>(pair_.place.a_from_b.scale);
    float shift = 0;
    for (int k = 0; k < 3; ++k) {
      const Quad m = pair_.turn[side][k];
      const float turned =
          std::fma(m.x[0], normal[0], std::fma(m.x[1], normal[1], m.x[2] * normal[2]));
      shift = std::fma(turned, pair_.row[1][k].x[3], shift);
      out.normal.x[k] = side == 0 ? normal[k] : turned;
      out.turned.x[k] = scale * (std::abs(turned) + kError);
    }
    if (side == 1) {
      low = scale * low + shift - 2 * pair_.pad[1];
      high = scale * high + shift + 2 * pair_.pad[1];
    }
    out.low.x[3] = low;
    out.high.x[3] = high;
    return true;
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

  /// Of two blocks the triangles whose boxes meet that of the other.
  IST_HD void place_blocks(std::uint32_t i, std::uint32_t j) {
    block_[0] = child(0, i).number();
    block_[1] = child(1, j).number();
    for (int k = team_.lane(); k < kBoth; k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth), v = k % static_cast<int>(kWidth);
      const MeshTree& mesh = pair_.mesh[side];
      const double* const x =
          in_global_memory(mesh.vertices) +
          std::size_t{3} *
              in_global_memory(mesh.blocks)[side == 0 ? block_[0] : block_[1]].vertex[v];
      const float at[3] = {static_cast<float>(x[0]), static_cast<float>(x[1]),
                           static_cast<float>(x[2])};
      Quad out = {{at[0], at[1], at[2], 0}};
      if (side == 1)
        for (int axis = 0; axis < 3; ++axis) {
          const Quad m = pair_.row[1][axis];
          out.x[axis] =
              std::fma(m.x[0], at[0], std::fma(m.x[1], at[1], std::fma(m.x[2], at[2], m.x[3])));
        }
      memory_.vertices[side][v] = out;
    }
    team_.sync();
    int left[2] = {0, 0};
    for (int first = 0; first < kBoth; first += Team::kWidth) {
      const int k = first + team_.lane(), side = k / static_cast<int>(kWidth);
      const auto t = static_cast<std::uint32_t>(k) % kWidth;
      const MeshBlock& block =
          in_global_memory(pair_.mesh[side].blocks)[side == 0 ? block_[0] : block_[1]];
      const std::uint32_t corner[3] = {block.corner[0][t], block.corner[1][t], block.corner[2][t]};
      const Quad p = memory_.vertices[side][corner[0]], q = memory_.vertices[side][corner[1]],
                 r = memory_.vertices[side][corner[2]];
      const Quad by_low = side == 0 ? memory_.boxes[1][j].other_low : memory_.boxes[0][i].low,
                 by_high = side == 0 ? memory_.boxes[1][j].other_high : memory_.boxes[0][i].high;
      const float slack = pair_.slack, wider = side == 0 ? slack : 0;
      ExactTriangle out;
      bool meets = t < block.triangles;
      for (int axis = 0; axis < 3; ++axis) {
        const float low = std::fmin(p.x[axis], std::fmin(q.x[axis], r.x[axis]));
        const float high = std::fmax(p.x[axis], std::fmax(q.x[axis], r.x[axis]));
        meets = meets && low - slack <= by_high.x[axis] && high + slack >= by_low.x[axis];
        out.low.x[axis] = low - wider;
        out.high.x[axis] = high + wider;
      }
      // Most pairs of blocks end here.
      const std::uint32_t lanes = team_.ballot(meets);
      if (Team::kWidth == kBoth && (lanes >> kWidth == 0 || lanes << kWidth == 0)) break;
      place_plane(p, q, r, by_low, by_high, out);
      out.name = t | corner[0] << 8 | corner[1] << 16 | corner[2] << 24;
      for (int s = 0; s < 2; ++s) {
        int total = 0;
        const bool mine = meets && side == s;
        const int at = left[s] + team_.exclusive_count(mine, total);
        if (mine) memory_.triangles[s][at] = out;
        left[s] += total;
      }
    }
    team_.sync();
    at_ = met_ = tested_ = 0;
    pairs_ = left[0] * left[1];
    columns_ = Pairs(left[1]);
  }

  /// A triangle's plane, for heights of points of a box.
  IST_HD void place_plane(const Quad& p, const Quad& q, const Quad& r, const Quad& low,
                          const Quad& high, ExactTriangle& out) const {
    float u[3], v[3], longest = 0, farthest = 0;
    for (int k = 0; k < 3; ++k) {
      u[k] = q.x[k] - p.x[k];
      v[k] = r.x[k] - p.x[k];
      longest = std::fmax(longest, std::fmax(std::abs(u[k]), std::abs(v[k])));
      farthest = std::fmax(farthest, std::fmax(high.x[k] - p.x[k], p.x[k] - low.x[k]));
    }
    Quad& n = out.plane;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      n.x[k] = std::fma(u[l], v[m], -(u[m] * v[l]));
    }
    n.x[3] = -std::fma(n.x[0], p.x[0], std::fma(n.x[1], p.x[1], n.x[2] * p.x[2]));
    // What moves points, as in by_plane(), and places them in floats; and what floats round.
    const float moved = 0.5f * pair_.slack;
    longest += moved;
    farthest += moved;
    out.margin = longest * (12 * moved * (2 * farthest + longest) + 4e-6f * longest * farthest);
  }

  /// The next of their pairs of triangles: those whose boxes meet.
  IST_HD void meet_triangles() {
    const int k = at_ + team_.lane();
    const std::uint32_t i = k < pairs_ ? columns_.row(static_cast<std::uint32_t>(k)) : 0,
                        j = k < pairs_ ? static_cast<std::uint32_t>(k) - i * columns_.columns : 0;
    const Quad a_low = memory_.triangles[0][i].low, a_high = memory_.triangles[0][i].high,
               b_low = memory_.triangles[1][j].low, b_high = memory_.triangles[1][j].high;
    bool meets = k < pairs_;
    for (int axis = 0; axis < 3; ++axis)
      meets = meets && a_low.x[axis] <= b_high.x[axis] && a_high.x[axis] >= b_low.x[axis];
    at_ += Team::kWidth;
    int total = 0;
    const int before = team_.exclusive_count(meets, total);
    if (meets) memory_.met[met_ + before] = static_cast<std::uint8_t>(kWidth * i + j);
    met_ += total;
    if (at_ >= pairs_) team_.sync();
  }

  /// Of the next of these: what no plane keeps apart, as floats tell, waits.
  IST_HD void test_planes() {
    const int k = tested_ + team_.lane();
    const std::uint32_t met = memory_.met[k < met_ ? k : tested_];
    const ExactTriangle &a = memory_.triangles[0][met / kWidth],
                        &b = memory_.triangles[1][met % kWidth];
    const bool waits = k < met_ && !apart_by(a, b.name, 1) && !apart_by(b, a.name, 0);
    tested_ += Team::kWidth;
    int total = 0;
    const auto before = static_cast<std::uint32_t>(team_.exclusive_count(waits, total));
    if (waits) {
      std::uint32_t(&slot)[2] = memory_.queue[(head_ + queued_ + before) % kExactWaiting];
      slot[0] = kWidth * block_[0] + a.name % kWidth;
      slot[1] = kWidth * block_[1] + b.name % kWidth;
    }
    queued_ += static_cast<std::uint32_t>(total);
    if (tested_ >= met_) team_.sync();  // all have read what the next blocks overwrite
  }

  /// Whether a triangle's plane has another, of a side, on one side for certain.
  IST_HD bool apart_by(const ExactTriangle& plane, std::uint32_t name, int side) const {
    const Quad n = plane.plane;
    float least = kFar, most = -kFar;
    for (int k = 0; k < 3; ++k) {
      const Quad x = memory_.vertices[side][name >> (8 + 8 * k) & 0xFF];
      const float height =
          std::fma(n.x[0], x.x[0], std::fma(n.x[1], x.x[1], std::fma(n.x[2], x.x[2], n.x[3])));
      least = std::fmin(least, height);
      most = std::fmax(most, height);
    }
    return least > plane.margin || most < -plane.margin;
  }

  /// Keeps pairs that no plane keeps apart, and those whose signs might differ if points moved by
  /// the room.
  IST_HD bool sift() {
    team_.sync();
    const std::uint32_t taken = queued_ < kBatch ? queued_ : kBatch;
    const auto lane = static_cast<std::uint32_t>(team_.lane());
    const bool has = lane < taken;
    const std::uint32_t(&slot)[2] = memory_.queue[(head_ + (has ? lane : 0)) % kExactWaiting];
    const std::uint32_t pair[2] = {slot[0], slot[1]};
    head_ = (head_ + taken) % kExactWaiting;
    queued_ -= taken;
    team_.sync();
    Apart apart = Apart::settled;
    if (has) {
      apart = by_plane(1, pair);
      if (apart != Apart::settled) {
        const Apart other = by_plane(0, pair);
        if (other > apart) apart = other;
      }
    }
    // Of those that only are near once for each pair of blocks, if they follow each other.
    const std::uint32_t of_a = apart == Apart::certain ? pair[0] / kWidth : kNone,
                        of_b = pair[1] / kWidth;
    const int before = team_.lane() - 1;
    const std::uint32_t before_a = team_.broadcast(of_a, before < 0 ? 0 : before),
                        before_b = team_.broadcast(of_b, before < 0 ? 0 : before);
    const bool again =
        before < 0 ? near_[0] == of_a && near_[1] == of_b : before_a == of_a && before_b == of_b;
    near_[0] = team_.broadcast(of_a, Team::kWidth - 1);
    near_[1] = team_.broadcast(of_b, Team::kWidth - 1);
    return append(team_, pool_, crossing, apart == Apart::no, pair[0], pair[1]) &&
           append(team_, pool_, near, of_a != kNone && !again, pair[0], pair[1]);
  }
  static constexpr std::uint32_t kNone = ~0u;

  enum class Apart {
    no,
    certain,  ///< as doubles tell, B moved aside
    settled,  ///< wherever points move by the room, too
  };

  /// Whether the plane of the other side's triangle has a side's on one side.
  IST_HD Apart by_plane(int side, const std::uint32_t (&pair)[2]) const {
    exact::Point plane[3];
    pair_.load(1 - side, pair[1 - side], plane);
    const auto largest = [](const exact::Point& x) {
      return std::fmax(std::abs(x.x), std::fmax(std::abs(x.y), std::abs(x.z)));
    };
    const double room = pair_.reach[0];
    const exact::Point u = plane[1] - plane[0], v = plane[2] - plane[0];
    const double longest = std::fmax(largest(u), largest(v)) + room;
    const exact::FilteredPlane filtered(u, v, (side == 1 ? 1 : -1) * pair_.aside);
    const MeshBlock& block = in_global_memory(pair_.mesh[side].blocks)[pair[side] / kWidth];
    int sum = 0;
    bool settled = true;
    IST_ROLLED
    for (int k = 0; k < 3; ++k) {
      const exact::Point r =
          pair_.vertex(side, block.vertex[block.corner[k][pair[side] % kWidth]]) - plane[0];
      const exact::Determinant height = filtered.height(r);
      sum += height.sign;
      // What the room moves: six products of three numbers; moving aside is within the room too.
      const double moved = 12 * room * longest * (2 * largest(r) + longest);
      settled = settled && std::abs(height.value) > height.error + moved;
    }
    if (sum != 3 && sum != -3) return Apart::no;
    return settled ? Apart::settled : Apart::certain;
  }

  const Team& team_;
  const ExactPair& pair_;
  ExactSearchMemory& memory_;
  std::uint64_t* const waiting_;
  const std::uint32_t most_waiting_;
  const ExactPool pool_;
  MeshNode node_[2] = {};            ///< that are opened
  bool opens_[2] = {false, false};   ///< whose children are looked at
  std::uint32_t count_ = 0;          ///< that wait
  std::uint32_t found_ = 0;          ///< pairs of blocks
  std::uint32_t block_[2] = {0, 0};  ///< whose triangles are met
  int at_ = 0, pairs_ = 0;           ///< pairs of them
  int tested_ = 0, met_ = 0;         ///< of which the boxes meet
  Pairs columns_{0};
  std::uint32_t head_ = 0, queued_ = 0;
  std::uint32_t near_[2] = {kNone, kNone};  ///< blocks of the last lane, if near
};

}  // namespace ist::gpu
