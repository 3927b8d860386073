#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/seen_triangles.h"

// Boxes and terrains: fields whose triangles are generated on demand (query/shape/patch_shapes.h).

namespace ist::gpu {

// The result of a traversal: balls that triangles intersect, each with the triangles that may.

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

// One team tests the balls of leaf blocks against triangles. A ball that no triangle intersects is
// inside or outside as a whole and is summed here. Other balls are kept for DiscSums, with the
// triangles that may intersect them.

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
  /// Drops what the caller has taken: the pairs, and at the `end` of a part the balls too.
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
  std::uint32_t met_[kItemsALane];  ///< triangles that meet an item's ball and wait to be listed
  bool two_ = false, first_ = false, last_ = false;  ///< of the block under test
  bool tests_ = false, lists_ = false;               ///< something waits
};

/// A face of a box or of a cell of a terrain.
struct FacetId {
  std::uint32_t a, b;
};

struct FacetWalkMemory : WalkMemory {
  TestMemory<FacetId> tests;
};

/// The triangles of a box or a terrain, as a Source of BallTests.
class FacetSource {
 public:
  using Id = FacetId;

  /// `whole`: a ball around all that is queried.
  IST_HD FacetSource(const FieldRef& field, const double (&whole)[4])
      : field_(field), whole_(whole) {}

  IST_HD void corners(const FacetId& id, double (&c)[3][3]) const {
    if (field_.kind == FieldKind::box) {
      field_.box.corners(id.a, c);
      return;
    }
    const std::int64_t i = std::int64_t{id.a} - 1, j = std::int64_t{id.b / 2} - 1;
    const bool second = id.b % 2 != 0;
    grid_point(i, j, c[0]);
    grid_point(i + 1, second ? j + 1 : j, c[1]);
    grid_point(second ? i : i + 1, j + 1, c[2]);
  }

  /// The triangles that may be near a ball, by number.
  class Near {
   public:
    Near() = default;
    IST_HD Near(const FieldRef& field, const double (&x)[3], double reach) {
      if (field.kind == FieldKind::box) return;
      for (int k = 0; k < 2; ++k) {
        std::int64_t to;
        field.height.cells_near(k, x[k], reach, from_[k], to);
        count_[k] = to - from_[k] + 1;
      }
    }

    IST_HD std::uint64_t size() const {
      return from_[0] == kBox ? 12 : 2 * static_cast<std::uint64_t>(count_[0] * count_[1]);
    }
    IST_HD FacetId operator[](std::uint64_t i) const {
      if (from_[0] == kBox) return {static_cast<std::uint32_t>(i), 0};
      const auto cell = static_cast<std::int64_t>(i / 2);
      const std::int64_t row = cell / count_[0];
      return {
          static_cast<std::uint32_t>(from_[0] + (cell - row * count_[0]) + 1),
          static_cast<std::uint32_t>(2 * (from_[1] + row + 1)) + static_cast<std::uint32_t>(i % 2)};
    }

   private:
    static constexpr std::int64_t kBox = -2;
    std::int64_t from_[2] = {kBox, 0}, count_[2] = {0, 0};
  };

  template <class Team, class Visit>
  IST_HD void each_near(const Team& team, const double (&x)[3], double reach,
                        const Visit& visit) const {
    const Near near(field_, x, reach);
    const std::uint64_t size = near.size();
    for (std::uint64_t base = 0; base < size; base += Team::kWidth) {
      const std::uint64_t i = base + static_cast<std::uint64_t>(team.lane());
      visit(i < size, i < size ? near[i] : FacetId{});
    }
  }

  template <class Team>
  IST_HD bool inside(const Team&, bool wanted, const double (&x)[3]) const {
    if (!wanted) return false;
    if (field_.kind == FieldKind::box) return field_.box.holds(x);
    const PlainTerrain& f = field_.height;
    return x[2] < f.surface(
                      x[0], x[1], [&](std::int64_t i, std::int64_t j) { return f.height(i, j); });
  }

  /// A ball near at most one face of a box needs no triangles.
  IST_HD bool settles(const double (&x)[3], double r, BallPart& part) const {
    if (field_.kind != FieldKind::box) return false;
    int axis;
    double side;
    if (field_.box.faces_near(x, r, axis, side) > 1) return false;
    PlainSample at = {-r, {}};
    for (int k = 0; k < 3; ++k) {
      at.distance = k == axis ? -field_.box.below_face(k, side, x[k]) : at.distance;
      at.gradient[k] = k == axis ? side : 0;
    }
    part = flat_part(at, r);
    return true;
  }

 private:
  IST_HD void grid_point(std::int64_t i, std::int64_t j, double (&p)[3]) const {
    p[0] = field_.height.point(0, i, whole_[0], whole_[3]);
    p[1] = field_.height.point(1, j, whole_[1], whole_[3]);
    p[2] = field_.height.height(i, j);
  }

  const FieldRef& field_;
  const double (&whole_)[4];
};

/// Finds the balls that the triangles of a box or a terrain intersect, part by part. Sums balls
/// that are inside as a whole or near a single face.
template <class Team>
class FacetWalk {
 public:
  /// `memory` contains the tree and its place.
  IST_HD FacetWalk(const Team& team, FacetWalkMemory& memory, PartSums& sums)
      : team_(team),
        m_(memory),
        sums_(sums),
        source_(memory.field, memory.whole),
        tests_(team, memory, memory.tests, source_, sums) {}

  IST_HD void start() {
    if (team_.lane() == 0) {
      const double centre[3] = {m_.whole[0], m_.whole[1], m_.whole[2]};
      m_.tests.seen.look_from(centre, m_.whole[3]);
    }
    team_.sync();
  }

  /// Calls take(met, end) with the results. `end`: the part is complete, else more of the same
  /// balls follow. Once take() returns false, the rest is traversed without tests.
  template <class Take>
  IST_HD void run(const Take& take) {
    FieldWalk<Team> walk(team_, m_, sums_);
    walk.run([&](const std::uint32_t* blocks, int have) { add(blocks, have, take); });
  }

 private:
  /// Tests leaf blocks, or without any hands over the rest.
  template <class Take>
  IST_HD void add(const std::uint32_t* blocks, int have, const Take& take) {
    for (int next = 0; goes_on_;) {
      if (tests_.step()) continue;
      const bool ends = !tests_.full();
      if (ends && staged_ < near_size_) {
        stage_more();
      } else if (ends && have > 0 && next == have) {
        return;
      } else if (ends && have > 0 && tests_.has_space()) {
        begin(blocks[next++]);
      } else {
        goes_on_ = take(tests_.met(), ends);
        tests_.forget(ends);
        if (have == 0) return;
      }
    }
  }

  IST_HD void begin(std::uint32_t block) {
    block_ = block;
    first_ = true;
    staged_ = 0;
    const NodeBall ball = m_.tree.ball(0, block);
    double centre[3];
    m_.place.a_from_b.apply_fused(ball.centre, centre);
    const double reach = ball.r * m_.place.a_from_b.scale * (1 + 1e-12);
    near_ = FacetSource::Near(m_.field, centre, reach);
    near_size_ = near_.size();
    if (m_.field.kind == FieldKind::box) return;
    if (team_.lane() == 0) m_.tests.seen.look_from(centre, reach);
    team_.sync();
  }

  /// Stages the block's test against the next triangles that may be near it.
  IST_HD void stage_more() {
    std::uint32_t near = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int place = i * Team::kWidth + team_.lane();
      const std::uint64_t k = staged_ + static_cast<std::uint64_t>(place);
      bool comes = k < near_size_;
      if (comes && !seen_) {
        const FacetId id = near_[k];
        double c[3][3];
        source_.corners(id, c);
        m_.tests.id[place] = id;
        m_.tests.seen.see(place, c);
        comes = m_.field.kind == FieldKind::box ||
                SeenTriangles::meets(m_.tests.seen.from_centre(place), 1 + kSeenTolerance);
      }
      near |= team_.ballot(comes) << (i * Team::kWidth);
    }
    seen_ = m_.field.kind == FieldKind::box;
    staged_ += kSeen;
    for (int half = team_.lane(); half < 2; half += Team::kWidth) {
      m_.tests.tested[half].block = block_;
      m_.tests.tested[half].triangles = near;
    }
    team_.sync();
    tests_.stage(false, first_, staged_ >= near_size_);
    first_ = false;
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;

  const Team& team_;
  FacetWalkMemory& m_;
  PartSums& sums_;
  const FacetSource source_;
  BallTests<Team, FacetSource> tests_;
  bool goes_on_ = true;
  std::uint32_t block_ = 0;                   ///< the current block
  bool first_ = false;                        ///< it has not been tested
  bool seen_ = false;                         ///< the triangles of a box are, for all blocks
  FacetSource::Near near_;                    ///< triangles that may come near it
  std::uint64_t near_size_ = 0, staged_ = 0;  ///< the number of near triangles, and of those staged
};

}  // namespace ist::gpu
