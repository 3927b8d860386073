#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/solid_ref.h"
#include "cuda/query/tree_ref.h"
#include "query/base/pair_place.h"
#include "query/base/precision.h"

// One team searches two trees for two minima at once, the gap of the inner spheres and that of
// their cover balls: depth first, the nearest child first, like GapDescent of query/separation.cpp.
// Two pairs of one kind are visited at a time: item k of 32 is child, or sphere, k % 16 of pair k /
// 16.
//
// Gaps in the arithmetic of a block (Real) are lowered by their rounding, and those that may still
// be least are computed in double. So both minima are those of all pairs of spheres in double, in
// any order of visits.

namespace ist::gpu {

/// The least gaps of two trees, or of some of their pairs of spheres. A's unit frame.
struct GapTotals {
  static constexpr double kNone = 1.7976931348623157e308;

  double gap;                 ///< least of the spheres
  double cover;               ///< the least of the cover balls; of unopened pairs a lower bound
  std::uint32_t a, b;         ///< spheres of the least gap
  std::uint32_t visits;       ///< node pairs opened
  std::uint32_t spheres;      ///< sphere pairs measured
  std::uint32_t out_of_time;  ///< 1: a limit of visits stopped the search

  IST_HD void clear() {
    gap = cover = kNone;
    a = b = ~0u;
    visits = spheres = out_of_time = 0;
  }
  /// Takes a gap if it is less. Among equal gaps the spheres of lower number are kept.
  IST_HD void meet(double new_gap, std::uint32_t new_a, std::uint32_t new_b, double new_cover) {
    if (new_gap < gap || (new_gap == gap && (new_a < a || (new_a == a && new_b < b)))) {
      gap = new_gap;
      a = new_a;
      b = new_b;
    }
    cover = new_cover < cover ? new_cover : cover;
  }
  IST_HD void add(const GapTotals& other) {
    meet(other.gap, other.a, other.b, other.cover);
    visits += other.visits;
    spheres += other.spheres;
    out_of_time |= other.out_of_time;
  }
  IST_HD bool overlap() const { return gap <= 0; }
};

/// A ball in the coordinates of a block.
template <class Real>
struct alignas(4 * sizeof(Real)) LensSide {
  Real x, y, z, r;
};

IST_HD inline float root(float x) { return sqrtf(x); }
IST_HD inline double root(double x) { return sqrt(x); }

constexpr int kGapPairsAtOnce = 2;
constexpr int kGapItems = kGapPairsAtOnce * static_cast<int>(kWidth);
/// The size of the stack. It holds groups of children, each deeper than the one below.
constexpr int kGapStack = kGapItems * (2 * (kMaxLevels - 1) + 1);
constexpr int kGapNodeBits =
    28;  ///< of a node's number; the rest of a word is the level and a flag
static_assert(kMaxSpheres == 1u << kGapNodeBits && 2 * kMaxLevels <= 16);

/// The state of a team for a pair of trees.
template <class Real>
struct GapMemory {
  PairPlace place;
  TreeRef tree[2];
  CoverRef cover[2];
  IST_HD RootBall root(int side) const { return RootBall::of(tree[side].root, cover[side].root); }

  Real turn[9];           ///< place.a_from_b.m
  GapTotals best;         ///< so far
  GapTotals before, sum;  ///< of a divided search: of its first part, of all parts
  /// A node of A; above kGapNodeBits twice the level, plus 1 if A is opened next. For B the same
  /// without the 1.
  std::uint32_t stack_a[kGapStack], stack_b[kGapStack];
  Real stack_gap[kGapStack], stack_cover[kGapStack];  ///< no gap below is less
  LensSide<Real> near[2][kGapItems];                  ///< spheres in play, pair by pair
  Real near_cover[2][kGapItems];
  std::uint32_t near_sphere[2][kGapItems];
};

/// Pending pairs in memory that all teams read.
struct GapEntries {
  std::uint32_t* a;
  std::uint32_t* b;
  double* gap;
  double* cover;
};

template <class Team, class Real>
class GapDescent {
 public:
  /// `memory.place`, `memory.tree` and `memory.cover` are set.
  IST_HD GapDescent(const Team& team, GapMemory<Real>& memory) : team_(team), m_(memory) {
    if (team_.lane() == 0)
      for (int i = 0; i < 9; ++i) m_.turn[i] = static_cast<Real>(m_.place.a_from_b.m[i]);
    const double length = span(m_.root(0), m_.root(1), m_.place.a_from_b);
    // Limits and gaps are rounded too: a third more.
    double margin = ist::distance_error<Real>(length) * (4.0 / 3);
    if (sizeof(Real) == 8) {
      // If the distance exceeds double precision, everything would be a candidate; GapTotals::cover
      // is inexact then.
      const double most =
          kFarMargin * (m_.tree[0].root[3] + m_.place.a_from_b.scale * m_.tree[1].root[3]);
      margin = margin < most ? margin : most;
    }
    margin_ = static_cast<Real>(margin);
    team_.sync();
  }

  /// Begins with the roots and a first bound from a pair of spheres. `covers`: gaps of cover balls
  /// are wanted.
  IST_HD void start(bool covers = true) {
    const TreeRef &a = m_.tree[0], &b = m_.tree[1];
    GapTotals first;
    first.clear();
    if (!covers) limit_cover_ = -kHuge;
    measure(0, 0, first);
    if (team_.lane() == 0) {
      m_.best = first;
      const bool of_a = opens_a(a.top, b.top, a.root[3] >= m_.place.a_from_b.scale * b.root[3]);
      m_.stack_a[0] = word(0, a.top, of_a);
      m_.stack_b[0] = word(0, b.top, false);
      m_.stack_gap[0] = m_.stack_cover[0] = -kHuge;
    }
    size_ = 1;
    team_.sync();
  }

  /// Continues as if only `before` were known. finish() then returns the difference.
  IST_HD void restart(const GapTotals& before) {
    if (team_.lane() == 0) m_.best.clear();
    limit_gap_ = limit_of(before.gap);
    limit_cover_ = limit_of(before.cover);
    visits_ = spheres_ = 0;
    team_.sync();
  }

  /// Begins with `count` pending pairs of another traversal of the same trees.
  IST_HD void resume(const GapEntries& from, std::uint32_t first, int count) {
    for (int k = team_.lane(); k < count; k += Team::kWidth) {
      const std::uint32_t at = first + static_cast<std::uint32_t>(k);
      m_.stack_a[k] = from.a[at];
      m_.stack_b[k] = from.b[at];
      m_.stack_gap[k] = static_cast<Real>(from.gap[at]);
      m_.stack_cover[k] = static_cast<Real>(from.cover[at]);
    }
    size_ = count;
    team_.sync();
  }

  /// Runs until at most `floor` pairs are pending, `most` were opened, or spheres overlap.
  IST_HD void run(int floor, std::uint32_t most) {
    while (!overlap()) {
      const int first = wanted_below(size_, floor);
      size_ = first < 0 ? floor : first + 1;
      if (first < 0 || visits_ >= most) return;
      int second = most - visits_ > 1 ? wanted_below(first, floor) : -1;
      const bool leaves = is_leaf(first);
      if (second >= 0 && is_leaf(second) != leaves) second = -1;
      const int have = second >= 0 ? 2 : 1;
      visits_ += static_cast<std::uint32_t>(have);
      size_ = second >= 0 ? second : first;
      if (leaves) {
        meet(first, second, have);
      } else {
        open(first, second, have);
      }
    }
  }

  IST_HD int waiting() const { return size_; }
  /// Two spheres overlap, so no other pair matters.
  IST_HD bool overlap() const { return limit_gap_ < 0; }
  IST_HD std::uint32_t visits() const { return visits_; }

  /// Writes the result to memory.best. Pending pairs above `floor` are dropped.
  IST_HD void finish(int floor) {
    double least = GapTotals::kNone;
    const bool left = size_ > floor && !overlap();
    for (int k = floor + team_.lane(); left && k < size_; k += Team::kWidth) {
      const double cover = static_cast<double>(m_.stack_cover[k]);
      least = cover < least ? cover : least;
    }
    size_ = floor;
    least = team_.min(least);
    if (team_.lane() == 0) {
      GapTotals& best = m_.best;
      best.cover = best.cover < least ? best.cover : least;
      best.visits = visits_;
      best.spheres = spheres_;
      best.out_of_time = left ? 1 : 0;
    }
    team_.sync();
  }

 private:
  static constexpr int kItemsALane = kGapItems / Team::kWidth;
  static constexpr Real kHuge = sizeof(Real) == 4 ? Real(1e38) : Real(1e300);
  static constexpr double kFarMargin = 1e-9;  ///< of both sizes

  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  IST_HD static std::uint32_t word(std::uint32_t node, int level, bool open) {
    return node | (2 * static_cast<std::uint32_t>(level) + (open ? 1 : 0)) << kGapNodeBits;
  }
  IST_HD static std::uint32_t node_of(std::uint32_t word) {
    return word & ((1u << kGapNodeBits) - 1);
  }
  IST_HD static int level_of(std::uint32_t word) {
    return static_cast<int>(word >> (kGapNodeBits + 1));
  }
  IST_HD static bool opens_a(int level_a, int level_b, bool a_is_larger) {
    return level_b == 0 || (level_a > 0 && a_is_larger);
  }
  IST_HD bool is_leaf(int k) const {
    return level_of(m_.stack_a[k]) == 0 && level_of(m_.stack_b[k]) == 0;
  }

  /// Rounds a limit up to Real.
  IST_HD static Real limit_of(double least) {
    constexpr Real kUp = 1 + (sizeof(Real) == 4 ? Real(0x1p-22) : Real(0));
    const Real limit = least < static_cast<double>(kHuge) ? static_cast<Real>(least) : kHuge;
    return least > 0 ? limit * kUp : -kHuge;
  }

  IST_HD bool wanted(Real gap, Real cover) const {
    return gap < limit_gap_ || cover < limit_cover_;
  }

  /// The topmost pair of [floor, top) that may be near enough; −1 if none is.
  IST_HD int wanted_below(int top, int floor) const {
    for (; top > floor; top -= Team::kWidth) {
      const int k = top - 1 - team_.lane();
      int total = 0;
      const int lane = team_.first(k >= floor && wanted(m_.stack_gap[k], m_.stack_cover[k]), total);
      if (total > 0) return top - 1 - lane;
    }
    return -1;
  }

  struct Child {
    std::uint32_t a, b;
    Real gap, cover;
    int place;  ///< −1: not wanted
  };

  /// Opens one or two pairs. Their children go on top of the stack, the nearest last.
  IST_HD void open(int first, int second, int have) {
    Child child[kItemsALane] = {};
    int count = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      child[i].place = -1;
      if (half < have) {
        const int k = half == 0 ? first : second;
        look_below(m_.stack_a[k], m_.stack_b[k], static_cast<std::uint32_t>(item(i)) % kWidth,
                   child[i]);
      }
      const bool is_wanted = half < have && child[i].place >= 0;
      int total = 0;
      const int place = count + team_.exclusive_count(is_wanted, total);
      if (is_wanted) child[i].place = place;
      count += total;
    }
    team_.sync();
    for (int i = 0; i < kItemsALane; ++i)
      if (child[i].place >= 0) m_.stack_gap[size_ + child[i].place] = child[i].gap;
    team_.sync();
    int at[kItemsALane];
    for (int i = 0; i < kItemsALane; ++i) {
      at[i] = size_;
      for (int k = 0; child[i].place >= 0 && k < count; ++k) {
        const Real other = m_.stack_gap[size_ + k];
        at[i] += other > child[i].gap || (other == child[i].gap && k > child[i].place) ? 1 : 0;
      }
    }
    team_.sync();
    for (int i = 0; i < kItemsALane; ++i) {
      if (child[i].place < 0) continue;
      m_.stack_a[at[i]] = child[i].a;
      m_.stack_b[at[i]] = child[i].b;
      m_.stack_gap[at[i]] = child[i].gap;
      m_.stack_cover[at[i]] = child[i].cover;
    }
    size_ += count;
    team_.sync();
  }

  /// Tests child `lane` of the opened node of a pair. Its position is 0 if it may be near enough.
  IST_HD void look_below(std::uint32_t word_a, std::uint32_t word_b, std::uint32_t lane,
                         Child& child) const {
    const bool of_a = (word_a >> kGapNodeBits & 1) != 0;
    const int level_a = level_of(word_a), level_b = level_of(word_b);
    const int level_x = of_a ? level_a : level_b, level_y = of_a ? level_b : level_a;
    const std::uint32_t opened = node_of(of_a ? word_a : word_b);
    const std::uint32_t other = node_of(of_a ? word_b : word_a);
    const int side_x = of_a ? 0 : 1, side_y = 1 - side_x;
    const TreeRef &x = m_.tree[side_x], &y = m_.tree[side_y];
    const Similarity& map = of_a ? m_.place.a_from_b : m_.place.b_from_a;
    const NodeBall ball = y.ball(level_y, other);
    const double cover_y = m_.cover[side_y].of_node(level_y, other, y.top);
    double moved[3];
    map.apply_fused(ball.centre, moved);
    const BallBlock& block = x.blocks[level_x][opened];
    const Origin& origin = x.origins[level_x][opened];
    const Real dx = static_cast<Real>(block.x[lane]) - static_cast<Real>(moved[0] - origin.x);
    const Real dy = static_cast<Real>(block.y[lane]) - static_cast<Real>(moved[1] - origin.y);
    const Real dz = static_cast<Real>(block.z[lane]) - static_cast<Real>(moved[2] - origin.z);
    const Real d = root((dx * dx + dy * dy) + dz * dz);
    const Real radius = static_cast<Real>(block.r[lane]);
    const Real radius_y = static_cast<Real>(ball.r * map.scale);
    const Real cover = static_cast<Real>(m_.cover[side_x].below(level_x, opened)[lane]);
    const Real factor = of_a ? Real(1) : static_cast<Real>(m_.place.a_from_b.scale);
    child.gap = factor * ((d - radius) - radius_y) - margin_;
    child.cover = factor * ((d - cover) - static_cast<Real>(cover_y * map.scale)) - margin_;
    const std::uint32_t node = opened * kWidth + lane;
    const int next_a = of_a ? level_a - 1 : level_a, next_b = of_a ? level_b : level_b - 1;
    const bool next_of_a = opens_a(next_a, next_b, of_a ? radius >= radius_y : radius_y >= radius);
    child.a = word(of_a ? node : other, next_a, next_of_a);
    child.b = word(of_a ? other : node, next_b, false);
    child.place = radius > 0 && wanted(child.gap, child.cover) ? 0 : -1;
  }

  /// A sphere of one side of a pair of leaves.
  struct Side {
    LensSide<Real> ball;  ///< along A's axes, from the origin of A's block
    Real cover;
    bool there;  ///< may be nearest
  };

  IST_HD void meet(int first, int second, int have) {
    int near[2] = {0, 0}, of_first[2] = {0, 0};
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      const std::uint32_t lane = static_cast<std::uint32_t>(item(i)) % kWidth;
      const int k = half == 0 ? first : second;
      const std::uint32_t leaf[2] = {half < have ? node_of(m_.stack_a[k]) : 0,
                                     half < have ? node_of(m_.stack_b[k]) : 0};
      Side side[2];
      side[0].there = side[1].there = false;
      if (half < have) look(leaf[0], leaf[1], lane, side);
      for (int s = 0; s < 2; ++s) {
        int total = 0;
        const int place = near[s] + team_.exclusive_count(side[s].there, total);
        near[s] += total;
        team_.exclusive_count(side[s].there && half == 0, total);
        of_first[s] += total;
        if (!side[s].there) continue;
        m_.near[s][place] = side[s].ball;
        m_.near_cover[s][place] = side[s].cover;
        m_.near_sphere[s][place] = kWidth * leaf[s] + lane;
      }
    }
    team_.sync();
    const int tests = of_first[0] * of_first[1];
    const int rows = near[1] - of_first[1];  // spheres of B in the second pair
    const int all = tests + (near[0] - of_first[0]) * rows;
    GapTotals mine;  // this lane's; limits are local until all have met
    mine.clear();
    bool found = false;
    for (int k = team_.lane(); k < all; k += Team::kWidth) {
      const bool later = k >= tests;
      const int width = later ? rows : of_first[1];
      const int in_pair = later ? k - tests : k;
      const int row = in_pair / width;
      const int at_a = (later ? of_first[0] : 0) + row;
      const int at_b = (later ? of_first[1] : 0) + in_pair - row * width;
      const LensSide<Real> a = m_.near[0][at_a], b = m_.near[1][at_b];
      const Real dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z;
      const Real d = root((dx * dx + dy * dy) + dz * dz);
      const Real gap = ((d - a.r) - b.r) - margin_;
      const Real cover = ((d - m_.near_cover[0][at_a]) - m_.near_cover[1][at_b]) - margin_;
      if (!wanted(gap, cover)) continue;
      measure(m_.near_sphere[0][at_a], m_.near_sphere[1][at_b], mine);
      found = true;
    }
    spheres_ += static_cast<std::uint32_t>(all);
    if (team_.any(found)) keep(mine);
    team_.sync();
  }

  /// Keeps the least of what lanes found.
  IST_HD void keep(const GapTotals& mine) {
    limit_gap_ = team_.min(limit_gap_);
    limit_cover_ = team_.min(limit_cover_);
    const double gap = team_.min(mine.gap), cover = team_.min(mine.cover);
    const std::uint64_t pair = std::uint64_t{mine.a} << 32 | mine.b;
    const std::uint64_t first = team_.min(mine.gap == gap ? pair : ~std::uint64_t{0});
    if (team_.lane() == 0)
      m_.best.meet(gap, static_cast<std::uint32_t>(first >> 32), static_cast<std::uint32_t>(first),
                   cover);
  }

  /// Loads sphere `lane` of both leaves of a pair, and tests it against the other's ball.
  IST_HD void look(std::uint32_t leaf_a, std::uint32_t leaf_b, std::uint32_t lane,
                   Side (&side)[2]) const {
    const BallBlock& a = m_.tree[0].blocks[0][leaf_a];
    const BallBlock& b = m_.tree[1].blocks[0][leaf_b];
    const Origin& origin_a = m_.tree[0].origins[0][leaf_a];
    const Origin& origin_b = m_.tree[1].origins[0][leaf_b];
    const Similarity& map = m_.place.a_from_b;
    const Real scale = static_cast<Real>(map.scale);
    const double from[3] = {origin_b.x, origin_b.y, origin_b.z};
    double moved[3];
    map.apply_fused(from, moved);
    const Real off[3] = {static_cast<Real>(moved[0] - origin_a.x),
                         static_cast<Real>(moved[1] - origin_a.y),
                         static_cast<Real>(moved[2] - origin_a.z)};
    const NodeBall ball_a = m_.tree[0].ball(0, leaf_a);
    const NodeBall ball_b = m_.tree[1].ball(0, leaf_b);
    map.apply_fused(ball_b.centre, moved);
    const LensSide<Real> near_a = {static_cast<Real>(ball_a.centre[0] - origin_a.x),
                                   static_cast<Real>(ball_a.centre[1] - origin_a.y),
                                   static_cast<Real>(ball_a.centre[2] - origin_a.z),
                                   static_cast<Real>(ball_a.r)};
    const LensSide<Real> near_b = {
        static_cast<Real>(moved[0] - origin_a.x), static_cast<Real>(moved[1] - origin_a.y),
        static_cast<Real>(moved[2] - origin_a.z), static_cast<Real>(ball_b.r * map.scale)};
    const Real cover_a = static_cast<Real>(m_.cover[0].of_node(0, leaf_a, m_.tree[0].top));
    const Real cover_b = static_cast<Real>(m_.cover[1].of_node(0, leaf_b, m_.tree[1].top)) * scale;
    const Real* const turn = m_.turn;
    const Real bx = static_cast<Real>(b.x[lane]), by = static_cast<Real>(b.y[lane]),
               bz = static_cast<Real>(b.z[lane]);
    side[0].ball = {static_cast<Real>(a.x[lane]), static_cast<Real>(a.y[lane]),
                    static_cast<Real>(a.z[lane]), static_cast<Real>(a.r[lane])};
    side[1].ball = {((turn[0] * bx + turn[1] * by) + turn[2] * bz) + off[0],
                    ((turn[3] * bx + turn[4] * by) + turn[5] * bz) + off[1],
                    ((turn[6] * bx + turn[7] * by) + turn[8] * bz) + off[2],
                    static_cast<Real>(b.r[lane]) * scale};
    side[0].cover = static_cast<Real>(m_.cover[0].below(0, leaf_a)[lane]);
    side[1].cover = static_cast<Real>(m_.cover[1].below(0, leaf_b)[lane]) * scale;
    side[0].there = in_play(side[0], near_b, cover_b);
    side[1].there = in_play(side[1], near_a, cover_a);
  }

  IST_HD bool in_play(const Side& sphere, const LensSide<Real>& ball, Real cover) const {
    const Real dx = sphere.ball.x - ball.x, dy = sphere.ball.y - ball.y,
               dz = sphere.ball.z - ball.z;
    const Real d = root((dx * dx + dy * dy) + dz * dz);
    return sphere.ball.r > 0 &&
           wanted(((d - sphere.ball.r) - ball.r) - margin_, ((d - sphere.cover) - cover) - margin_);
  }

  /// Computes the gaps of a pair of spheres in double.
  IST_HD void measure(std::uint32_t a, std::uint32_t b, GapTotals& best) {
    const NodeBall ball_a = m_.tree[0].ball(kSphereLevel, a);
    const NodeBall ball_b = m_.tree[1].ball(kSphereLevel, b);
    const Similarity& map = m_.place.a_from_b;
    double moved[3];
    map.apply_fused(ball_b.centre, moved);
    const double dx = moved[0] - ball_a.centre[0], dy = moved[1] - ball_a.centre[1],
                 dz = moved[2] - ball_a.centre[2];
    const double d = root((dx * dx + dy * dy) + dz * dz);
    const double cover_a = static_cast<double>(m_.cover[0].spheres[a]);
    const double cover_b = static_cast<double>(m_.cover[1].spheres[b]);
    best.meet((d - ball_a.r) - map.scale * ball_b.r, a, b, (d - cover_a) - map.scale * cover_b);
    const Real gap = limit_of(best.gap), cover = limit_of(best.cover);
    limit_gap_ = gap < limit_gap_ ? gap : limit_gap_;
    limit_cover_ = cover < limit_cover_ ? cover : limit_cover_;
  }

  const Team& team_;
  GapMemory<Real>& m_;
  Real margin_;
  int size_ = 0;
  Real limit_gap_ = kHuge, limit_cover_ = kHuge;  ///< the team's, except inside of meet()
  std::uint32_t visits_ = 0, spheres_ = 0;        ///< the team's
};

}  // namespace ist::gpu
