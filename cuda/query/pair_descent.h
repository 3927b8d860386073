#pragma once

#include <cstdint>

#include "cuda/query/lens_sums.h"
#include "cuda/query/pair_place.h"
#include "cuda/query/tree_ref.h"
#include "numerics/host_device.h"

// Two trees met by one team: the sum that Descent (query/descent/descent.h) makes level by level,
// here depth first, so that what waits fits into a team's own memory. Two pairs are looked at a
// time: item k of 32 is child, or sphere, k % 16 of pair k / 16.

namespace ist::gpu {

constexpr int kPairsAtOnce = 2;
constexpr int kItems = kPairsAtOnce * static_cast<int>(kWidth);
/// A step leaves at most so many pairs more than it takes.
constexpr int kStackRoom = OpeningSteps::kMost * (kItems - kPairsAtOnce) + kPairsAtOnce;
constexpr int kLeafRoom = kPairsAtOnce + kItems;
constexpr int kNodeBits = 28;  ///< of a node's number; the rest of a word is the step
static_assert(kMaxSpheres == 1u << kNodeBits && OpeningSteps::kMost < 16);

/// What a team needs for a pair of trees.
template <class Real>
struct PairMemory {
  PairPlace place;
  TreeRef tree[2];
  OpeningSteps steps;
  Real turn[9];  ///< place.a_from_b.m
  LensTotals totals;
  std::uint32_t stack_a[kStackRoom];  ///< node of A and the step, << kNodeBits, that opens the pair
  std::uint32_t stack_b[kStackRoom];
  std::uint32_t leaf_a[kLeafRoom], leaf_b[kLeafRoom];
  LensSide<Real> near[2][kItems];  ///< spheres that reach the other block's ball, pair by pair
  LensSide<Real> apart[2 * 32], lever[2 * 32];  ///< balls that meet
  Real rounding[2 * 32];
  LensSide<Real> block[kPairsAtOnce];  ///< A's origin from B's unit-frame origin; r: the rounding
};

template <class Team, class Real>
class PairDescent {
 public:
  /// `memory.place` and `memory.tree` are set.
  IST_HD PairDescent(const Team& team, PairMemory<Real>& memory) : team_(team), m_(memory) {
    if (team_.lane() == 0) {
      m_.steps.plan(m_.tree[0], m_.tree[1], m_.place.a_from_b.scale);
      m_.totals.clear();
      for (int i = 0; i < 9; ++i) m_.turn[i] = static_cast<Real>(m_.place.a_from_b.m[i]);
    }
    for (Real& s : sum_) s = 0;
    team_.sync();
  }

  /// The roots, which meet.
  IST_HD void start() {
    const bool no_steps = m_.steps.count == 0;
    if (team_.lane() == 0) {
      (no_steps ? m_.leaf_a : m_.stack_a)[0] = 0;
      (no_steps ? m_.leaf_b : m_.stack_b)[0] = 0;
    }
    (no_steps ? leaves_ : size_) = 1;
    team_.sync();
  }

  /// Pairs that another descent of the same trees left waiting.
  IST_HD void resume(const std::uint32_t* a, const std::uint32_t* b, int count) {
    for (int k = team_.lane(); k < count; k += Team::kWidth) {
      m_.stack_a[k] = a[k];
      m_.stack_b[k] = b[k];
    }
    size_ = count;
    team_.sync();
  }

  /// Goes on until no more than `floor` pairs wait, or `most` pairs of leaves and more have been
  /// met and none of them waits.
  IST_HD void run(int floor, std::uint32_t most) {
    while (size_ > floor || leaves_ > 0) {
      if (leaves_ == 0 && met_ >= most) break;
      if (size_ > floor && leaves_ < kPairsAtOnce) {
        open(size_ - floor);
      } else {
        meet();
      }
    }
    sum_list(0);
    fold();
    met_ = 0;
  }

  IST_HD int waiting() const { return size_; }

 private:
  struct Pair {
    std::uint32_t a, b;
    int step;
  };

  /// Opens the pairs on top, no more than `have`.
  IST_HD void open(int have) {
    have = have < kPairsAtOnce ? have : kPairsAtOnce;
    std::uint32_t entry_a[kItemsALane], entry_b[kItemsALane];
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      entry_a[i] = half < have ? m_.stack_a[size_ - 1 - half] : 0;
      entry_b[i] = half < have ? m_.stack_b[size_ - 1 - half] : 0;
    }
    team_.sync();
    size_ -= have;
    visits_ += static_cast<std::uint32_t>(have);
    for (int i = 0; i < kItemsALane; ++i) {
      const bool active = item(i) / static_cast<int>(kWidth) < have;
      const Pair pair = {entry_a[i] & ((1u << kNodeBits) - 1), entry_b[i],
                         static_cast<int>(entry_a[i] >> kNodeBits)};
      open_item(pair, static_cast<std::uint32_t>(item(i)) % kWidth, active);
    }
    team_.sync();
  }

  IST_HD void open_item(const Pair& pair, std::uint32_t lane, bool active) {
    const bool of_a = m_.steps.opens_a[active ? pair.step : 0];
    const int level_a = m_.steps.level_a[pair.step], level_b = m_.steps.level_b[pair.step];
    const std::uint32_t opened = of_a ? pair.a : pair.b;
    const std::uint32_t child = opened * kWidth + lane;
    bool meets = false, contained = false;
    if (active) {
      const TreeRef& x = m_.tree[of_a ? 0 : 1];
      const TreeRef& y = m_.tree[of_a ? 1 : 0];
      const PairMap& map = of_a ? m_.place.a_from_b : m_.place.b_from_a;
      const int level_x = of_a ? level_a : level_b, level_y = of_a ? level_b : level_a;
      const NodeBall ball = y.ball(level_y, of_a ? pair.b : pair.a);
      double moved[3];
      map.apply(ball.centre, moved);
      const BallBlock& block = x.blocks[level_x][opened];
      const Origin& origin = x.origins[level_x][opened];
      const float r = static_cast<float>(ball.r * map.scale);
      const float dx = block.x[lane] - static_cast<float>(moved[0] - origin.x);
      const float dy = block.y[lane] - static_cast<float>(moved[1] - origin.y);
      const float dz = block.z[lane] - static_cast<float>(moved[2] - origin.z);
      const float d2 = dx * dx + dy * dy + dz * dz;
      const float radius = block.r[lane];
      const float reach = (radius + r) * (1 + kRoom);
      meets = radius > 0 && d2 < reach * reach;
      const float within = (r - radius) * (1 - kRoom);
      contained = meets && level_y == kSphereLevel && within > 0 && d2 < within * within;
    }
    push(meets && !contained, of_a ? child : pair.a, of_a ? pair.b : child, pair.step + 1);
    if (team_.any(contained)) add_contained(contained, of_a, of_a ? level_a : level_b, child);
  }

  /// Puts a pair where the step that comes next takes it.
  IST_HD void push(bool waits, std::uint32_t a, std::uint32_t b, int step) {
    const bool leaf = waits && step >= m_.steps.count;
    int total = 0;
    int place = leaves_ + team_.exclusive_count(leaf, total);
    leaves_ += total;
    if (leaf) {
      m_.leaf_a[place] = a;
      m_.leaf_b[place] = b;
    }
    const bool node = waits && !leaf;
    place = size_ + team_.exclusive_count(node, total);
    size_ += total;
    if (node) {
      m_.stack_a[place] = a | static_cast<std::uint32_t>(step) << kNodeBits;
      m_.stack_b[place] = b;
    }
  }

  /// Adds up the spheres below the children of level − 1 that lanes flag: each child lies in one
  /// sphere of the other side.
  IST_HD void add_contained(bool flag, bool of_a, int level, std::uint32_t child) {
    for (;;) {
      int total = 0;
      const int lane = team_.first(flag, total);
      if (total == 0) return;
      if (team_.lane() == lane) flag = false;
      const bool a = team_.broadcast(of_a ? 1 : 0, lane) != 0;
      add_subtree(a, team_.broadcast(level, lane) - 1, team_.broadcast(child, lane));
    }
  }

  IST_HD void add_subtree(bool of_a, int level, std::uint32_t node) {
    const TreeRef& tree = m_.tree[of_a ? 0 : 1];
    const PairMap& map = m_.place.a_from_b;
    const std::uint64_t full = std::uint64_t{kWidth} << (4 * level);
    const std::uint64_t all = std::uint64_t{kWidth} * tree.leaf_blocks;
    const std::uint64_t begin = full * node;
    const std::uint64_t end = begin + full < all ? begin + full : all;
    for (std::uint64_t base = begin; base < end; base += Team::kWidth) {
      const std::uint64_t i = base + static_cast<std::uint64_t>(team_.lane());
      bool is_sphere = false;
      if (i < end) {
        const NodeBall ball = tree.ball(kSphereLevel, static_cast<std::uint32_t>(i));
        if (ball.r > 0) {
          is_sphere = true;
          double at[3];
          for (int k = 0; k < 3; ++k)
            at[k] = of_a ? ball.centre[k] - map.t[k]
                         : (map.m[3 * k] * ball.centre[0] + map.m[3 * k + 1] * ball.centre[1]) +
                               map.m[3 * k + 2] * ball.centre[2];
          const double r = of_a ? ball.r : ball.r * map.scale;
          const double caps = 4 * (r * r * r);
          sum_[kCaps] += static_cast<Real>(caps);
          for (int k = 0; k < 3; ++k) sum_[kMoment + k] += static_cast<Real>(caps * at[k]);
        }
      }
      int total = 0;
      team_.exclusive_count(is_sphere, total);
      spheres_ += static_cast<std::uint32_t>(total);
      count_sum();
    }
  }

  /// A leaf block, or a single sphere, of one side in a pair that meets.
  struct Side {
    LensSide<Real> sphere;  ///< in A's axes, from A's block's origin
    bool there = false;     ///< of this item
  };

  /// Sums the pairs of leaves on top of the list.
  IST_HD void meet() {
    const int have = leaves_ < kPairsAtOnce ? leaves_ : kPairsAtOnce;
    int near[2] = {0, 0}, of_first[2] = {0, 0};
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      Side side[2];
      if (half < have)
        look(m_.leaf_a[leaves_ - 1 - half], m_.leaf_b[leaves_ - 1 - half],
             static_cast<std::uint32_t>(item(i)) % kWidth, half, side);
      for (int s = 0; s < 2; ++s) {
        int total = 0;
        const int place = near[s] + team_.exclusive_count(side[s].there, total);
        near[s] += total;
        team_.exclusive_count(side[s].there && half == 0, total);
        of_first[s] += total;
        if (side[s].there) m_.near[s][place] = side[s].sphere;
      }
    }
    leaves_ -= have;
    met_ += static_cast<std::uint32_t>(have);
    team_.sync();
    const int first = of_first[0] * of_first[1];
    const int rows = near[1] - of_first[1];  // spheres of B in the second pair
    const int tests = first + (near[0] - of_first[0]) * rows;
    for (int base = 0; base < tests; base += Team::kWidth) {
      const int k = base + team_.lane();
      bool meets = false;
      const int half = k >= first ? 1 : 0;
      LensSide<Real> a = {}, apart = {};
      if (k < tests) {
        const int width = half != 0 ? rows : of_first[1];
        const int in_pair = half != 0 ? k - first : k;
        const int row = in_pair / width;
        a = m_.near[0][(half != 0 ? of_first[0] : 0) + row];
        apart = m_.near[1][(half != 0 ? of_first[1] : 0) + in_pair - row * width];
        apart.x -= a.x;
        apart.y -= a.y;
        apart.z -= a.z;
        const Real sum = a.r + apart.r;
        meets = (apart.x * apart.x + apart.y * apart.y) + apart.z * apart.z < sum * sum;
      }
      int total = 0;
      const int place = listed_ + team_.exclusive_count(meets, total);
      if (meets) {
        m_.apart[place] = apart;
        const LensSide<Real>& block = m_.block[half];
        m_.lever[place] = {a.x + block.x, a.y + block.y, a.z + block.z, a.r};
        m_.rounding[place] = block.r;
      }
      listed_ += total;
      spheres_ += static_cast<std::uint32_t>(total);
      team_.sync();
      sum_list(Team::kWidth);
    }
    team_.sync();
  }

  /// Sphere `lane` of both leaves of a pair, and whether it reaches the other's ball.
  IST_HD void look(std::uint32_t leaf_a, std::uint32_t leaf_b, std::uint32_t lane, int half,
                   Side (&side)[2]) {
    const int level_a = m_.steps.level_a[m_.steps.count];
    const int level_b = m_.steps.level_b[m_.steps.count];
    const std::uint32_t block_a = level_a == kSphereLevel ? leaf_a / kWidth : leaf_a;
    const std::uint32_t block_b = level_b == kSphereLevel ? leaf_b / kWidth : leaf_b;
    const BallBlock& a = m_.tree[0].blocks[0][block_a];
    const BallBlock& b = m_.tree[1].blocks[0][block_b];
    const Origin& origin_a = m_.tree[0].origins[0][block_a];
    const Origin& origin_b = m_.tree[1].origins[0][block_b];
    const PairMap& map = m_.place.a_from_b;
    const Real scale = static_cast<Real>(map.scale);
    const double from[3] = {origin_b.x, origin_b.y, origin_b.z};
    double moved[3];
    map.apply(from, moved);
    const Real off[3] = {static_cast<Real>(moved[0] - origin_a.x),
                         static_cast<Real>(moved[1] - origin_a.y),
                         static_cast<Real>(moved[2] - origin_a.z)};
    const NodeBall ball_a = m_.tree[0].ball(level_a, leaf_a);
    const NodeBall ball_b = m_.tree[1].ball(level_b, leaf_b);
    map.apply(ball_b.centre, moved);
    const LensSide<Real> near_a = {static_cast<Real>(ball_a.centre[0] - origin_a.x),
                                   static_cast<Real>(ball_a.centre[1] - origin_a.y),
                                   static_cast<Real>(ball_a.centre[2] - origin_a.z),
                                   static_cast<Real>(ball_a.r)};
    const LensSide<Real> near_b = {
        static_cast<Real>(moved[0] - origin_a.x), static_cast<Real>(moved[1] - origin_a.y),
        static_cast<Real>(moved[2] - origin_a.z), static_cast<Real>(ball_b.r * map.scale)};
    const Real* const turn = m_.turn;
    const Real bx = b.x[lane], by = b.y[lane], bz = b.z[lane];
    side[0].sphere = {a.x[lane], a.y[lane], a.z[lane], a.r[lane]};
    side[1].sphere = {((turn[0] * bx + turn[1] * by) + turn[2] * bz) + off[0],
                      ((turn[3] * bx + turn[4] * by) + turn[5] * bz) + off[1],
                      ((turn[6] * bx + turn[7] * by) + turn[8] * bz) + off[2], b.r[lane] * scale};
    side[0].there =
        (level_a != kSphereLevel || leaf_a % kWidth == lane) && reaches(side[0].sphere, near_b);
    side[1].there =
        (level_b != kSphereLevel || leaf_b % kWidth == lane) && reaches(side[1].sphere, near_a);
    if (lane != 0) return;
    // What each sphere's coordinates are rounded by is bounded by how far the balls reach.
    constexpr Real kRounding = 12 * (sizeof(Real) == 4 ? Real(0x1p-24) : Real(0x1p-53));
    m_.block[half] = {static_cast<Real>(origin_a.x - map.t[0]),
                      static_cast<Real>(origin_a.y - map.t[1]),
                      static_cast<Real>(origin_a.z - map.t[2]),
                      kRounding * ((largest(near_a) + near_a.r) + (largest(near_b) + near_b.r))};
  }

  IST_HD static Real largest(const LensSide<Real>& ball) {
    const Real x = ball.x < 0 ? -ball.x : ball.x;
    const Real y = ball.y < 0 ? -ball.y : ball.y;
    const Real z = ball.z < 0 ? -ball.z : ball.z;
    return x > y ? (x > z ? x : z) : (y > z ? y : z);
  }

  IST_HD static bool reaches(const LensSide<Real>& sphere, const LensSide<Real>& ball) {
    const Real dx = sphere.x - ball.x, dy = sphere.y - ball.y, dz = sphere.z - ball.z;
    const Real reach = (sphere.r + ball.r) * (1 + kRoom);
    return sphere.r > 0 && dx * dx + dy * dy + dz * dz < reach * reach;
  }

  /// Sums listed lenses, as many at once as the team is wide, until fewer than `full` are left; of
  /// 0 all.
  IST_HD void sum_list(int full) {
    while (listed_ > 0 && listed_ >= full) {
      const int take = listed_ < Team::kWidth ? listed_ : Team::kWidth;
      listed_ -= take;
      const int k = listed_ + team_.lane();
      if (team_.lane() < take) add_lens(m_.lever[k], m_.apart[k], m_.rounding[k], sum_);
      team_.sync();
      count_sum();
    }
  }

  /// Rounded sums stay short: a lane adds few numbers before they go on in double.
  IST_HD void count_sum() {
    if (++summed_ >= 16) fold();
  }

  IST_HD void fold() {
    for (int k = 0; k < kTerms; ++k) {
      const double sum = team_.sum(static_cast<double>(sum_[k]));
      if (team_.lane() == 0) m_.totals.term[k] += sum;
      sum_[k] = 0;
    }
    if (team_.lane() == 0) {
      m_.totals.spheres += spheres_;
      m_.totals.visits += visits_;
    }
    spheres_ = visits_ = 0;
    summed_ = 0;
    team_.sync();
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  static constexpr float kRoom = 2e-6f;  ///< share of a distance, above its rounding

  const Team& team_;
  PairMemory<Real>& m_;
  int size_ = 0, leaves_ = 0, listed_ = 0;
  std::uint32_t met_ = 0;      ///< pairs of leaves
  Real sum_[kTerms];           ///< this lane's
  int summed_ = 0;             ///< numbers in it, at most
  std::uint32_t spheres_ = 0;  ///< the team's
  std::uint32_t visits_ = 0;
};

}  // namespace ist::gpu
