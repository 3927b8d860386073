#pragma once

#include <cmath>
#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "cuda/query/pair_memory.h"

// The sum over two trees by one team. Descent (query/tree_overlap/descent.h) visits level by level;
// this traversal is depth first, so that its pending pairs fit into a team's memory.

namespace ist::gpu {

/// Receives a traversal's lenses: adds them to one sum, the pair's.
template <class Team>
class PairSums {
 public:
  IST_HD PairSums(const Team& team, PairMemory& memory) : team_(team), m_(memory) {
    for (float& s : sum_) s = 0;
  }

  /// The sum to which the lane's next lenses are added.
  IST_HD float (&begin())[kTerms] { return sum_; }
  /// Ends a round of lenses. Where `flag` is set, their spheres have these numbers. Called by all
  /// lanes.
  IST_HD void end(bool, std::uint32_t, std::uint32_t) { ++summed_; }

  /// A lane adds few numbers in float before they continue in double.
  IST_HD bool full() const { return summed_ >= 16; }

  IST_HD void fold() {
    if (summed_ > 0) {
      const double back = 1 / m_.unit;
      for (int k = 0; k < kTerms; ++k) {
        const double sum = team_.sum(static_cast<double>(sum_[k]));
        sum_[k] = 0;
        if (team_.lane() != 0) continue;
        m_.totals.term[k] += sum * term_factor(back, k);
      }
    }
    summed_ = 0;
  }

 private:
  const Team& team_;
  PairMemory& m_;
  float sum_[kTerms];  ///< this lane's
  int summed_ = 0;     ///< numbers in it, at most
};

/// `Sums` receives the lenses, like PairSums.
template <class Team, class Sums = PairSums<Team>>
class PairDescent {
 public:
  /// `memory.place` and `memory.tree` are set.
  IST_HD PairDescent(const Team& team, PairMemory& memory)
      : PairDescent(team, memory, Sums(team, memory)) {}
  IST_HD PairDescent(const Team& team, PairMemory& memory, const Sums& sums)
      : team_(team), m_(memory), sums_(sums) {
    if (team_.lane() == 0) {
      m_.steps.plan(m_.tree[0], m_.tree[1], m_.place.a_from_b.scale);
      m_.totals.clear();
      const Similarity& map = m_.place.a_from_b;
      for (int i = 0; i < 3; ++i)
        m_.turn[i] = {static_cast<float>(map.m[3 * i]), static_cast<float>(map.m[3 * i + 1]),
                      static_cast<float>(map.m[3 * i + 2]), static_cast<float>(map.scale)};
      m_.to_single = m_.steps.level_a[m_.steps.count] == kSphereLevel ||
                     m_.steps.level_b[m_.steps.count] == kSphereLevel;
      m_.blur = 8;
      for (const double t : map.t) m_.blur += t < 0 ? -t : t;
      m_.blur *= 1e-15;
      const double b = m_.tree[1].root[3] * m_.place.a_from_b.scale;
      m_.unit = std::ldexp(1.0, -std::ilogb(b < m_.tree[0].root[3] ? b : m_.tree[0].root[3]));
    }
    for (int n = team_.lane(); n <= static_cast<int>(kWidth); n += Team::kWidth)
      m_.share[n] = n > 0 ? 0xFFFFu / static_cast<unsigned>(n) + 1 : 0;
    team_.sync();
  }

  /// Begins with the roots, which intersect.
  IST_HD void start() {
    const bool no_steps = m_.steps.count == 0;
    if (team_.lane() == 0) {
      (no_steps ? m_.leaf_a : m_.stack_a)[0] = 0;
      (no_steps ? m_.leaf_b : m_.stack_b)[0] = 0;
    }
    (no_steps ? leaves_ : size_) = 1;
    wide_ = kFirstStack - (m_.steps.count * kGrowth + kPairsAtOnce);
    team_.sync();
  }

  /// Begins with pending pairs of another traversal of the same trees.
  IST_HD void resume(const std::uint32_t* a, const std::uint32_t* b, int count) {
    for (int k = team_.lane(); k < count; k += Team::kWidth) {
      m_.stack_a[k] = a[k];
      m_.stack_b[k] = b[k];
    }
    size_ = count;
    divide();
    team_.sync();
  }

  /// From here on runs are tasks, whose sums do not depend on what is below their floor.
  IST_HD void divide() { wide_ = kTaskStack; }

  /// Runs until at most `floor` pairs are pending, or at least `most` pairs of leaves were visited
  /// and the pending pairs leave space for tasks.
  IST_HD void run(int floor, std::uint32_t most) {
    while (size_ > floor || leaves_ > 0) {
      const bool enough = met_ >= most && size_ <= wide_;
      if (enough && leaves_ == 0) break;
      if (size_ > floor && leaves_ < kAhead && !enough)
        open(size_ - floor);
      else
        meet();
    }
    sum_list(1);
    fold();
    met_ = 0;
  }

  IST_HD int waiting() const { return size_; }

 private:
  struct Pair {
    std::uint32_t a, b;
    int step;
  };

  IST_HD static Pair unpacked(std::uint32_t a, std::uint32_t b) {
    return {a & kNodeMask, b, static_cast<int>(a >> kNodeBits)};
  }

  /// The number of pairs on top of a floor, out of `have`, that are opened together. From any
  /// number up to wide_ on, the stack has space for what two at a time leave.
  IST_HD int breadth(int have) const {
    const int by_stack = (wide_ - have) / (static_cast<int>(kWidth) - 1);
    const int by_leaves = (kLeafCapacity - leaves_) / static_cast<int>(kWidth);
    int most = by_stack < by_leaves ? by_stack : by_leaves;
    most = most < kAhead ? most : kAhead;
    most = most > kPairsAtOnce ? most : kPairsAtOnce;
    return have < most ? have : most;
  }

  /// Opens the pairs on top, at most `have`.
  IST_HD void open(int have) {
    have = breadth(have);
    for (int k = team_.lane(); k < have; k += Team::kWidth)
      ready_opening(k, m_.stack_a[size_ - 1 - k], m_.stack_b[size_ - 1 - k]);
    team_.sync();
    size_ -= have;
    visits_ += static_cast<std::uint32_t>(have);
    IST_ROLLED
    for (int first = 0; first < have; first += kPairsAtOnce)
      for (int i = 0; i < kItemsALane; ++i) {
        const int k = first + item(i) / static_cast<int>(kWidth);
        const auto lane = static_cast<std::uint32_t>(item(i)) % kWidth;
        open_item(k < have ? k : first, lane, k < have);
      }
    team_.sync();
  }

  IST_HD void ready_opening(int k, std::uint32_t entry_a, std::uint32_t entry_b) {
    const Pair pair = unpacked(entry_a, entry_b);
    const bool of_a = m_.steps.opens_a[pair.step];
    const int level_a = m_.steps.level_a[pair.step], level_b = m_.steps.level_b[pair.step];
    const TreeRef& x = m_.tree[of_a ? 0 : 1];
    const int level_x = of_a ? level_a : level_b;
    const std::uint32_t opened = of_a ? pair.a : pair.b;
    const Similarity& map = of_a ? m_.place.a_from_b : m_.place.b_from_a;
    const NodeBall ball =
        m_.tree[of_a ? 1 : 0].ball(of_a ? level_b : level_a, of_a ? pair.b : pair.a);
    double moved[3];
    map.apply_fused(ball.centre, moved);
    const Origin& origin = x.origins[level_x][opened];
    m_.opening.other[k] = {
        static_cast<float>(moved[0] - origin.x), static_cast<float>(moved[1] - origin.y),
        static_cast<float>(moved[2] - origin.z), static_cast<float>(ball.r * map.scale)};
    m_.opening.block[k] = x.blocks[level_x] + opened;
    const bool to_leaf = pair.step + 1 >= m_.steps.count;
    const std::uint32_t next = to_leaf ? 0 : static_cast<std::uint32_t>(pair.step + 1) << kNodeBits;
    m_.opening.a[k] = (of_a ? pair.a * kWidth : pair.a) | next;
    m_.opening.b[k] = of_a ? pair.b : pair.b * kWidth;
    m_.opening.how[k] = (of_a ? kOpensA : 0) | (to_leaf ? kToLeaf : 0) |
                        ((of_a ? level_b : level_a) == kSphereLevel ? kIntoOne : 0) |
                        static_cast<std::uint32_t>(level_x - 1) << kLevelBit;
  }

  /// Pushes the pair's child for the next step if it intersects the other side.
  IST_HD void open_item(int k, std::uint32_t lane, bool active) {
    const Ball other = m_.opening.other[k];
    const BallBlock& block = *in_global_memory(m_.opening.block[k]);
    const std::uint32_t how = m_.opening.how[k];
    const float dx = block.x[lane] - other.x;
    const float dy = block.y[lane] - other.y;
    const float dz = block.z[lane] - other.z;
    const float radius = block.r[lane];
    const float d2 = std::fma(dx, dx, std::fma(dy, dy, dz * dz));
    const float reach = (radius + other.r) * (1 + kTolerance);
    bool meets = active && radius > 0 && d2 < reach * reach;
    const bool of_a = (how & kOpensA) != 0;
    const std::uint32_t a = m_.opening.a[k] + (of_a ? lane : 0);
    const std::uint32_t b = m_.opening.b[k] + (of_a ? 0 : lane);
    if (m_.to_single) {
      const float within = (other.r - radius) * (1 - kTolerance);
      const bool contained = meets && (how & kIntoOne) != 0 && within > 0 && d2 < within * within;
      meets = meets && !contained;
      if (team_.any(contained))
        add_contained(contained, of_a, static_cast<int>(how >> kLevelBit), a & kNodeMask,
                      b & kNodeMask);
    }
    const bool leaf = meets && (how & kToLeaf) != 0;
    int total = 0;
    int place = leaves_ + team_.exclusive_count(leaf, total);
    leaves_ += total;
    if (leaf) {
      m_.leaf_a[place] = a;
      m_.leaf_b[place] = b;
    }
    const bool node = meets && !leaf;
    place = size_ + team_.exclusive_count(node, total);
    size_ += total;
    if (node) {
      m_.stack_a[place] = a;
      m_.stack_b[place] = b;
    }
  }

  /// Adds the spheres below the nodes of A or B that lanes flag. Each such node is inside one
  /// sphere of the other side.
  IST_HD void add_contained(bool flag, bool of_a, int level, std::uint32_t a, std::uint32_t b) {
    for (;;) {
      int total = 0;
      const int lane = team_.first(flag, total);
      if (total == 0) return;
      if (team_.lane() == lane) flag = false;
      const bool is_a = team_.broadcast(of_a ? 1 : 0, lane) != 0;
      add_subtree(is_a, team_.broadcast(level, lane), team_.broadcast(is_a ? a : b, lane),
                  team_.broadcast(is_a ? b : a, lane));
    }
  }

  IST_HD void add_subtree(bool of_a, int level, std::uint32_t node, std::uint32_t other) {
    const TreeRef& tree = m_.tree[of_a ? 0 : 1];
    const std::uint64_t full = std::uint64_t{kWidth} << (4 * level);
    const std::uint64_t all = std::uint64_t{kWidth} * tree.leaf_blocks;
    const std::uint64_t begin = full * node;
    const std::uint64_t end = begin + full < all ? begin + full : all;
    for (std::uint64_t base = begin; base < end; base += Team::kWidth) {
      const std::uint64_t i = base + static_cast<std::uint64_t>(team_.lane());
      const auto number = static_cast<std::uint32_t>(i);
      float(&sum)[kTerms] = sums_.begin();
      bool is_sphere = false;
      if (i < end && tree.ball(kSphereLevel, number).r > 0) {
        is_sphere = true;
        add_ball(seen(of_a, number), m_.unit, sum);
      }
      int total = 0;
      team_.exclusive_count(is_sphere, total);
      spheres_ += static_cast<std::uint32_t>(total);
      sums_.end(is_sphere, of_a ? number : other, of_a ? other : number);
      if (sums_.full()) fold();
    }
  }

  /// A sphere along the axes of A's unit frame, relative to the origin of B's.
  IST_HD LensBall seen(bool of_a, std::uint32_t number) const {
    const Similarity& map = m_.place.a_from_b;
    const NodeBall ball = m_.tree[of_a ? 0 : 1].ball(kSphereLevel, number);
    if (of_a)
      return {{ball.centre[0] - map.t[0], ball.centre[1] - map.t[1], ball.centre[2] - map.t[2]},
              ball.r};
    LensBall out;
    map.turn_fused(ball.centre, out.at);
    out.r = ball.r * map.scale;
    return out;
  }

  /// Lists the spheres that may intersect in the pairs of leaves on top.
  IST_HD void meet() {
    const int have = leaves_ < kAhead ? leaves_ : kAhead;
    for (int k = team_.lane(); k < have; k += Team::kWidth)
      ready_meeting(k, m_.leaf_a[leaves_ - 1 - k], m_.leaf_b[leaves_ - 1 - k]);
    team_.sync();
    leaves_ -= have;
    met_ += static_cast<std::uint32_t>(have);
    IST_ROLLED
    for (int first = 0; first < have; first += kPairsAtOnce) meet_two(first, have);
    team_.sync();  // the last batch has been read
  }

  IST_HD void ready_meeting(int k, std::uint32_t leaf_a, std::uint32_t leaf_b) {
    const int level_a = m_.steps.level_a[m_.steps.count];
    const int level_b = m_.steps.level_b[m_.steps.count];
    const bool one_a = level_a == kSphereLevel, one_b = level_b == kSphereLevel;
    const std::uint32_t block_a = one_a ? leaf_a / kWidth : leaf_a;
    const std::uint32_t block_b = one_b ? leaf_b / kWidth : leaf_b;
    const Origin& origin_a = m_.tree[0].origins[0][block_a];
    const Origin& origin_b = m_.tree[1].origins[0][block_b];
    const Similarity& map = m_.place.a_from_b;
    const double from[3] = {origin_b.x, origin_b.y, origin_b.z};
    double moved[3];
    map.apply_fused(from, moved);
    Ball off = {static_cast<float>(moved[0] - origin_a.x),
                static_cast<float>(moved[1] - origin_a.y),
                static_cast<float>(moved[2] - origin_a.z), 0};
    const NodeBall ball_a = m_.tree[0].ball(level_a, leaf_a);
    const NodeBall ball_b = m_.tree[1].ball(level_b, leaf_b);
    map.apply_fused(ball_b.centre, moved);
    const Ball near_a = {static_cast<float>(ball_a.centre[0] - origin_a.x),
                         static_cast<float>(ball_a.centre[1] - origin_a.y),
                         static_cast<float>(ball_a.centre[2] - origin_a.z),
                         static_cast<float>(ball_a.r)};
    const Ball near_b = {
        static_cast<float>(moved[0] - origin_a.x), static_cast<float>(moved[1] - origin_a.y),
        static_cast<float>(moved[2] - origin_a.z), static_cast<float>(ball_b.r * map.scale)};
    // The rounding of a sphere's coordinates is bounded by the extent of the balls.
    constexpr float kRounding = 32 * 0x1p-24f;
    off.r = kRounding * ((largest(near_a) + near_a.r) + (largest(near_b) + near_b.r));
    m_.meeting.near_a[k] = near_a;
    m_.meeting.near_b[k] = near_b;
    m_.meeting.off[k] = off;
    m_.meeting.block_a[k] = block_a;
    m_.meeting.block_b[k] = block_b;
    m_.meeting.lanes[k] =
        (one_a ? 1u << leaf_a % kWidth : 0xFFFFu) | (one_b ? 1u << leaf_b % kWidth : 0xFFFFu) << 16;
  }

  IST_HD void meet_two(int first, int have) {
    Ball sphere[2][kItemsALane];
    std::uint32_t there[2] = {0, 0};  // bit k: item k's
    for (int i = 0; i < kItemsALane; ++i) {
      const int k = first + item(i) / static_cast<int>(kWidth);
      const auto lane = static_cast<std::uint32_t>(item(i)) % kWidth;
      bool near[2];
      look(k < have ? k : first, lane, sphere[0][i], sphere[1][i], near);
      for (int s = 0; s < 2; ++s)
        there[s] |= team_.ballot(near[s] && k < have) << (i * Team::kWidth);
    }
    if (there[0] == 0 || there[1] == 0) return;
    for (int i = 0; i < kItemsALane; ++i) {
      const int k = first + item(i) / static_cast<int>(kWidth);
      const std::uint32_t bit = 1u << item(i);
      for (int s = 0; s < 2; ++s) {
        if ((there[s] & bit) == 0) continue;
        const int place = count_bits(there[s] & (bit - 1));
        m_.near[s][place] = sphere[s][i];
        m_.number[s][place] = (s == 0 ? m_.meeting.block_a : m_.meeting.block_b)[k] * kWidth +
                              static_cast<std::uint32_t>(item(i)) % kWidth;
      }
    }
    team_.sync();
    // Spheres of A and B, in the first pair and in the second.
    constexpr std::uint32_t kFirst = (1u << kWidth) - 1;
    const int a0 = count_bits(there[0] & kFirst), b0 = count_bits(there[1] & kFirst);
    const int a1 = count_bits(there[0]) - a0, b1 = count_bits(there[1]) - b0;
    const int in_first = a0 * b0, tests = in_first + a1 * b1;
    const int last = first + 1 < have ? first + 1 : first;
    const float rounding[2] = {m_.meeting.off[first].r, m_.meeting.off[last].r};
    const std::uint32_t share[2] = {m_.share[b0], m_.share[b1]};
    IST_ROLLED
    for (int base = 0; base < tests; base += Team::kWidth) {
      const bool there = base + team_.lane() < tests;
      const int k = there ? base + team_.lane() : 0;
      const bool second = k >= in_first;
      const int in_pair = second ? k - in_first : k;
      const int row =
          static_cast<int>(static_cast<unsigned>(in_pair) * (second ? share[1] : share[0]) >> 16);
      const int of_a = second ? row + a0 : row;
      const int of_b = second ? in_pair - row * b1 + b0 : in_pair - row * b0;
      const Ball from = m_.near[0][of_a], to = m_.near[1][of_b];
      const float dx = to.x - from.x, dy = to.y - from.y, dz = to.z - from.z;
      const float reach = (from.r + to.r) + (second ? rounding[1] : rounding[0]);
      const bool may = there && std::fma(dx, dx, std::fma(dy, dy, dz * dz)) < reach * reach;
      int total = 0;
      const int place = listed_ + team_.exclusive_count(may, total);
      if (may) {
        m_.list_a[place] = m_.number[0][of_a];
        m_.list_b[place] = m_.number[1][of_b];
      }
      listed_ += total;
      if (listed_ < Team::kWidth) continue;
      team_.sync();
      sum_list(Team::kWidth);
      team_.sync();
    }
    team_.sync();
  }

  /// Loads sphere `lane` of both leaves of a pair, and tests it against the other's ball.
  IST_HD void look(int k, std::uint32_t lane, Ball& of_a, Ball& of_b, bool (&near)[2]) const {
    const MeetingPairs& pairs = m_.meeting;
    const BallBlock& a = in_global_memory(m_.tree[0].blocks[0])[pairs.block_a[k]];
    const BallBlock& b = in_global_memory(m_.tree[1].blocks[0])[pairs.block_b[k]];
    const Ball off = pairs.off[k], x = m_.turn[0], y = m_.turn[1], z = m_.turn[2];
    const float bx = b.x[lane], by = b.y[lane], bz = b.z[lane];
    of_a = {a.x[lane], a.y[lane], a.z[lane], a.r[lane]};
    of_b = {std::fma(x.x, bx, std::fma(x.y, by, std::fma(x.z, bz, off.x))),
            std::fma(y.x, bx, std::fma(y.y, by, std::fma(y.z, bz, off.y))),
            std::fma(z.x, bx, std::fma(z.y, by, std::fma(z.z, bz, off.z))), b.r[lane] * x.r};
    const std::uint32_t lanes = pairs.lanes[k] >> lane;
    near[0] = (lanes & 1) != 0 && reaches(of_a, pairs.near_b[k], off.r);
    near[1] = (lanes & 0x10000) != 0 && reaches(of_b, pairs.near_a[k], off.r);
  }

  IST_HD static float largest(const Ball& ball) {
    const float x = ball.x < 0 ? -ball.x : ball.x;
    const float y = ball.y < 0 ? -ball.y : ball.y;
    const float z = ball.z < 0 ? -ball.z : ball.z;
    return x > y ? (x > z ? x : z) : (y > z ? y : z);
  }

  IST_HD static bool reaches(const Ball& sphere, const Ball& ball, float rounding) {
    const float dx = sphere.x - ball.x, dy = sphere.y - ball.y, dz = sphere.z - ball.z;
    const float reach = (sphere.r + ball.r) + rounding;
    return sphere.r > 0 && std::fma(dx, dx, std::fma(dy, dy, dz * dz)) < reach * reach;
  }

  /// Sums listed lenses, a team's width at a time, until fewer than `full` are left.
  IST_HD void sum_list(int full) {
    while (listed_ >= full) {
      const int take = listed_ < Team::kWidth ? listed_ : Team::kWidth;
      listed_ -= take;
      const int k = listed_ + (team_.lane() < take ? team_.lane() : 0);
      const std::uint32_t number_a = m_.list_a[k], number_b = m_.list_b[k];
      float(&sum)[kTerms] = sums_.begin();
      bool meets = false;
      if (team_.lane() < take) {
        const LensBall a = seen(true, number_a);
        LensBall b = seen(false, number_b);
        for (int i = 0; i < 3; ++i) b.at[i] -= a.at[i];
        meets = add_lens(a, b, m_.unit, m_.blur, sum);
      }
      int total = 0;
      team_.exclusive_count(meets, total);
      spheres_ += static_cast<std::uint32_t>(total);
      sums_.end(meets, number_a, number_b);
      if (sums_.full()) fold();
    }
  }

  IST_HD void fold() {
    sums_.fold();
    if (team_.lane() == 0) {
      m_.totals.spheres += spheres_;
      m_.totals.visits += visits_;
    }
    spheres_ = visits_ = 0;
    team_.sync();
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  const Team& team_;
  PairMemory& m_;
  int size_ = 0, leaves_ = 0, listed_ = 0;
  int wide_ = 0;           ///< pairs on top of a floor that opening many at once may leave
  std::uint32_t met_ = 0;  ///< pairs of leaves
  Sums sums_;
  std::uint32_t spheres_ = 0;  ///< the team's
  std::uint32_t visits_ = 0;
};

}  // namespace ist::gpu
