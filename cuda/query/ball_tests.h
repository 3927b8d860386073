#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/seen_triangles.h"

// One team tests the balls of leaf blocks against triangles. A ball that no triangle intersects is
// inside or outside as a whole and is summed here. Other balls are kept for DiscSums (disc_sums.h),
// with the triangles that may intersect them.

namespace ist::gpu {

constexpr int kHeldBalls = 128;
constexpr int kPairCapacity = 256;  ///< of balls and triangles
constexpr int kPairsAtFirst = 128;  ///< no block's test begins with more
constexpr std::uint8_t kNotHeld = 255;
static_assert(kHeldBalls % 32 == 0 && kHeldBalls <= kNotHeld);
static_assert(kItems == 32 && kPairsAtFirst + kItems <= kPairCapacity);  // a word has a bit an item

/// A ball of a tree, 16 · block + lane, and whether its centre is inside, in one word.
using MetBall = std::uint32_t;
constexpr MetBall kCentreInside = MetBall{1} << 31;

/// A view of such balls and pairs. `Id`: the type of a triangle's name.
template <class Id>
struct MetView {
  const MetBall* balls;
  const Id* triangles;          ///< [pairs]
  const std::uint8_t* of_ball;  ///< [pairs]
  int ball_count, pair_count;
};

template <class Id>
struct MetBalls {
  MetBall balls[kHeldBalls];
  Id triangles[kPairCapacity];
  std::uint8_t of_ball[kPairCapacity];
};

/// Adds a ball that is inside or outside except for cones over the triangles that intersect it. Its
/// centre is at x, field's frame.
IST_HD inline void add_ball(const Similarity& a_from_b, const double (&x)[3], double r, bool inside,
                            double cones, PartSums& sums) {
  const double whole = ball_volume(r);
  const double part = (inside ? whole : 0) + cones;
  const double volume = part < 0 ? 0 : part > whole ? whole : part;
  const double none[3] = {0, 0, 0};
  const double at[3] = {x[0] - a_from_b.t[0], x[1] - a_from_b.t[1], x[2] - a_from_b.t[2]};
  sums.add(at, volume, none, none);
  sums.spheres += inside && cones == 0 ? 1 : 0;
}

/// A leaf block under test. Each half of the team's items tests one block, or both halves test the
/// same block and share its triangles.
struct TestedBlock {
  std::uint32_t block;
  std::uint32_t triangles;  ///< a bit for each staged triangle
};

template <class Id>
struct TestMemory {
  SeenTriangles seen;
  Id id[kSeen];  ///< of the staged triangles
  TestedBlock tested[2];
  std::uint8_t held_as[kItems];  ///< balls of the blocks that are tested; kNotHeld
  MetBalls<Id> met;
};

/// Source supplies the triangles:
///   Id: the type of a triangle's name
///   corners(id, c): the corners of a triangle
///   settles(x, r, part): true if a ball's part follows without triangles
///   each_near(team, x, reach, visit): all lanes call visit(there, id) for all triangles near a
///   ball inside(team, wanted, x): true if a lane's point is inside
///
/// A loop of the caller stages and tests blocks and lists pairs, so that each step exists once in a
/// kernel's code:
///
///   if (step()) continue;
///   if (full()) …   // take met(), forget(false)
///   else …          // stage() if has_space() for a first test, else take met(), forget(true)
template <class Team, class Source>
class BallTests {
 public:
  using Id = typename Source::Id;

  IST_HD BallTests(const Team& team, const ProbeMemory& probe, TestMemory<Id>& memory,
                   const Source& source, PartSums& sums)
      : team_(team), probe_(probe), m_(memory), source_(source), sums_(sums) {
    for (std::uint32_t& met : met_) met = 0;
  }

  /// True if the first test of further blocks fits. If not, call forget(true).
  IST_HD bool has_space() const { return held_ + kItems <= kHeldBalls && pairs_ <= kPairsAtFirst; }

  /// True if the list of pairs may overflow in the next step. Then call forget().
  IST_HD bool full() const { return lists_ && pairs_ + kItems > kPairCapacity; }

  /// The kept balls and the listed pairs.
  IST_HD MetView<Id> met() const {
    return {m_.met.balls, m_.met.triangles, m_.met.of_ball, held_, pairs_};
  }
  /// Drops what the caller has taken: the pairs and, at the `end` of a part, the balls too.
  IST_HD void forget(bool end) {
    pairs_ = 0;
    held_ = end ? 0 : held_;
  }

  /// Stages a test of the balls of m_.tested (two blocks, or one block by both halves) against the
  /// staged triangles. `first` and `last` mark the tests of a block that has triangles for several.
  IST_HD void stage(bool two, bool first, bool last) {
    two_ = two;
    first_ = first;
    last_ = last;
    tests_ = true;
  }

  /// Continues with the staged test. False if there is none, or if the list is full.
  IST_HD bool step() {
    if (full() || (!lists_ && !tests_)) return false;
    if (lists_)
      list();
    else
      test();
    return true;
  }

  /// The triangles of an item: all, or every second one if the other half tests the rest.
  struct Share {
    bool shared, second;
    IST_HD Share(int item, bool shared)
        : shared(shared), second(shared && item >= static_cast<int>(kWidth)) {}
    IST_HD std::uint32_t first(std::uint32_t of) const { return second ? of & (of - 1) : of; }
    IST_HD std::uint32_t next(std::uint32_t left) const {
      left &= left - 1;
      return shared ? left & (left - 1) : left;
    }
  };

  /// The staged triangles that may intersect a ball, a bit each.
  IST_HD std::uint32_t meet(std::uint32_t triangles, const double (&x)[3], double r,
                            const Share& share) const {
    float end[3];
    m_.seen.seen(x, end);
    const float radius = m_.seen.seen_radius(r);
    std::uint32_t met = 0;
    IST_ROLLED
    for (std::uint32_t left = share.first(triangles); left != 0; left = share.next(left))
      if (SeenTriangles::meets(m_.seen.from(lowest_bit(left), end), radius))
        met |= left & (~left + 1);
    return met;
  }

 private:
  IST_HD void test() {
    tests_ = false;
    double x[kItemsALane][3], r[kItemsALane];
    BallPart part[kItemsALane] = {};
    bool settled[kItemsALane];
    std::uint32_t touched = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const TestedBlock& block = tested(item(i));
      met_[i] = 0;
      settled[i] = true;
      if (place_ball(probe_, 0, block.block, item(i) % static_cast<int>(kWidth), x[i], r[i])) {
        settled[i] = source_.settles(x[i], r[i], part[i]);
        if (!settled[i]) met_[i] = meet(block.triangles, x[i], r[i], Share(item(i), !two_));
      }
      touched |= team_.ballot(met_[i] != 0) << (i * Team::kWidth);
    }
    constexpr std::uint32_t kHalf = (1u << kWidth) - 1;
    lists_ = touched != 0;
    if (!two_) touched = (touched | touched >> kWidth) & kHalf;
    for (int i = 0; i < kItemsALane; ++i) {
      const bool is_ball = two_ || item(i) < static_cast<int>(kWidth);
      if (first_ && is_ball) m_.held_as[item(i)] = kNotHeld;
      const bool fresh =
          is_ball && (touched >> item(i) & 1) != 0 && (first_ || m_.held_as[item(i)] == kNotHeld);
      int total = 0;
      const int place = held_ + team_.exclusive_count(fresh, total);
      held_ += total;
      if (fresh) hold(place, item(i));
      if (!last_) continue;
      const bool there = is_ball && r[i] > 0;
      const bool inside = source_.inside(team_, there && !settled[i], x[i]);
      if (!there) continue;
      if (settled[i])
        add_settled(x[i], part[i]);
      else if (m_.held_as[item(i)] != kNotHeld)
        m_.met.balls[m_.held_as[item(i)]] |= inside ? kCentreInside : 0;
      else if (inside)
        add_ball(probe_.place.a_from_b, x[i], r[i], true, 0, sums_);
    }
    team_.sync();
  }

  /// Lists one triangle for each ball.
  IST_HD void list() {
    bool more = false;
    for (int i = 0; i < kItemsALane; ++i) {
      const bool meets = met_[i] != 0;
      int total = 0;
      const int place = pairs_ + team_.exclusive_count(meets, total);
      pairs_ += total;
      if (meets) {
        const int ball = two_ ? item(i) : item(i) % static_cast<int>(kWidth);
        m_.met.of_ball[place] = m_.held_as[ball];
        m_.met.triangles[place] = m_.id[lowest_bit(met_[i])];
        met_[i] &= met_[i] - 1;
      }
      more = more || met_[i] != 0;
    }
    lists_ = team_.any(more);
    team_.sync();
  }

  IST_HD void hold(int place, int of_item) {
    m_.met.balls[place] =
        tested(of_item).block * kWidth + static_cast<std::uint32_t>(of_item) % kWidth;
    m_.held_as[of_item] = static_cast<std::uint8_t>(place);
  }

  IST_HD void add_settled(const double (&x)[3], const BallPart& part) {
    if (!(part.volume > 0)) return;
    const double* const t = probe_.place.a_from_b.t;
    const double at[3] = {x[0] - t[0], x[1] - t[1], x[2] - t[2]};
    sums_.add(at, part.volume, part.gradient, part.moment);
    ++sums_.spheres;
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }
  IST_HD const TestedBlock& tested(int of_item) const {
    return m_.tested[of_item / static_cast<int>(kWidth)];
  }

  const Team& team_;
  const ProbeMemory& probe_;
  TestMemory<Id>& m_;
  const Source source_;
  PartSums& sums_;
  int held_ = 0, pairs_ = 0;
  std::uint32_t met_[kItemsALane];  ///< triangles that meet an item's ball and are to be listed
  bool two_ = false, first_ = false, last_ = false;  ///< of the block under test
  bool tests_ = false, lists_ = false;               ///< work is pending
};

}  // namespace ist::gpu
