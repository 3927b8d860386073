#pragma once

#include <cstdint>

#include "cuda/query/bits.h"
#include "cuda/query/disc_part.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/part_sums.h"
#include "cuda/query/seen_triangles.h"
#include "numerics/host_device.h"

// Balls met by triangles, by one team: their parts inside the closed surface, exactly, as
// add_patch() and total_of() (query/probe/patch_sums.h, query/field/probe_sum.h) have them. Balls
// that no triangle meets are inside or outside as a whole; the others are held, and what meets goes
// to lists, so that the lanes of a warp are full where the work is.

namespace ist::gpu {

constexpr int kHeldBalls = 128;
constexpr std::uint32_t kNoBall = ~0u;
constexpr int kDiscRoom = 64;  ///< what is left after a round of a warp, and what a round may add
static_assert(kDiscRoom >= 2 * 32 - 1 && kHeldBalls % 32 == 0 && kItems == 32);
/// By less than this part of its radius a ball is moved, to be told from beside an edge on which
/// its centre lies.
constexpr double kMoved = 0x1p-10;

/// A triangle by whatever its source calls it.
struct TriangleId {
  std::uint32_t a, b;
};

struct BallTriangle {
  std::uint32_t ball;
  TriangleId triangle;
};

/// A leaf block that is tested. Each half of the team's items tests one; or both are the same, and
/// the halves share its triangles.
struct TestedBlock {
  double from[3];  ///< a point within the block's ball, if crossings tell sides
  bool inside;     ///< its side
  std::uint32_t block;
  std::uint32_t triangles;  ///< of those seen, a bit each
};

struct DiscMemory {
  double x[3][kHeldBalls], r[kHeldBalls];
  double cones[kHeldBalls], angle[kHeldBalls];
  std::uint32_t inside[kHeldBalls];  ///< whether its centre is
  std::uint32_t on_edge[kHeldBalls];
  SeenTriangles seen;
  TriangleId id[kSeen];  ///< of what is seen
  TestedBlock tested[2];
  std::uint8_t held_as[kItems];  ///< balls of the blocks that are tested; kNotHeld
  BallTriangle near[kDiscRoom], cut[kDiscRoom];

  /// In a direction in which no edge of a made thing lies (kAway, query/probe/patch_sums.cpp).
  IST_HD static void move(double r, double (&at)[3]) {
    at[0] += away(0) * r;
    at[1] += away(1) * r;
    at[2] += away(2) * r;
  }
  IST_HD static double away(int axis) {
    return 0x1p-12 * (axis == 0 ? 0.43877 : axis == 1 ? 0.61803 : 0.65236);
  }
};
constexpr std::uint8_t kNotHeld = 255;
static_assert(kHeldBalls <= kNotHeld);

/// Source: what has the triangles.
///   kCrossings: sides are told by the triangles on the way from TestedBlock::from, all of which
///     come near the block; else by inside()
///   corners(id, c): of a triangle
///   crosses(from, x, id): whether the way goes through a triangle, exactly
///   settles(x, r, part): whether a ball's part is told without triangles
///   each_near(team, x, reach, visit): visit(there, id) by all lanes for all triangles near a ball
///   inside(team, wanted, x): whether a lane's point is inside
///
/// Blocks are staged, tested against triangles, what meets is listed and drained, a round at a time
/// by a loop of the caller's, so that each step is in a kernel's code once:
///
///   if (step(rest)) continue;
///   if (rest) finish(); else …  // stage() where there is room() for a first test, or set `rest`
///
/// finish() may ask the source for what comes near a ball: nothing is to wait in its room then.
template <class Team, class Source>
class DiscSums {
 public:
  IST_HD DiscSums(const Team& team, const ProbeMemory& probe, DiscMemory& memory,
                  const Source& source, PartSums& sums)
      : team_(team), probe_(probe), m_(memory), source_(source), sums_(sums) {
    for (std::uint32_t& met : met_) met = 0;
  }

  /// Whether the first test of blocks finds room; if not, until finish().
  IST_HD bool room() const { return held_ + kItems <= kHeldBalls; }

  /// Readies the test of the balls of m_.tested, two blocks or one by both halves, against what is
  /// seen: `first` and `last` of one that has triangles for more than one test.
  IST_HD void stage(bool two, bool first, bool last) {
    two_ = two;
    first_ = first;
    last_ = last;
    tests_ = true;
  }

  /// Goes on with what is staged and listed; false where nothing is left. What is less than a
  /// team's worth waits for more, or for the `rest`.
  IST_HD bool step(bool rest) {
    if (drain(rest)) return true;
    if (rest || (!lists_ && !tests_)) return false;
    if (lists_)
      list();
    else
      test();
    return true;
  }

  /// What an item takes of triangles: all, or every other as the other half does the rest.
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

  /// Which of the triangles that are seen may meet a ball. If crossings tell sides: whether its
  /// centre is on the other side of them than `from`, but for those where that is unclear.
  IST_HD bool meet(const double (&from)[3], std::uint32_t triangles, const double (&x)[3], double r,
                   const Share& share, std::uint32_t& met, std::uint32_t& unclear) const {
    float begin[3], end[3];
    m_.seen.seen(x, end);
    if constexpr (Source::kCrossings) m_.seen.seen(from, begin);
    const float radius = m_.seen.seen_radius(r);
    bool crossed = false;
    IST_ROLLED
    for (std::uint32_t left = share.first(triangles); left != 0; left = share.next(left)) {
      const int k = lowest_bit(left);
      const std::uint32_t bit = left & (~left + 1);
      const SeenFrom to = m_.seen.from(k, end);
      if (SeenTriangles::meets(to, radius)) met |= bit;
      if constexpr (Source::kCrossings) {
        const Crossing crossing = SeenTriangles::crosses(m_.seen.from(k, begin), to);
        crossed = crossed != (crossing == Crossing::yes);
        if (crossing == Crossing::unclear) unclear |= bit;
      }
    }
    return crossed;
  }

  /// Sums what is held: nothing is listed any more.
  IST_HD void finish() {
    team_.sync();
    IST_ROLLED
    for (int base = 0; base < held_; base += Team::kWidth) {
      const int ball = base + team_.lane();
      bool on_edge = ball < held_ && m_.on_edge[ball] != 0;
      while (team_.any(on_edge)) {
        int total = 0;
        const int lane = team_.first(on_edge, total);
        put_right(team_, m_, source_, base + lane);
        if (lane == team_.lane()) on_edge = false;
      }
      if (ball >= held_) continue;
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]}, angle = m_.angle[ball];
      const bool told = size_of(angle) > kLeastAngle;
      add_ball(x, m_.r[ball], told ? angle < 0 : m_.inside[ball] != 0, m_.cones[ball]);
    }
    held_ = 0;
    team_.sync();
  }

  static constexpr double kLeastAngle = 1e-6;  ///< as query/field/probe_sum.h

 private:
  /// Tests what is staged.
  IST_HD void test() {
    tests_ = false;
    double x[kItemsALane][3], r[kItemsALane];
    PartInside part[kItemsALane] = {};
    bool settled[kItemsALane];
    std::uint32_t touched = 0, odd = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const TestedBlock& block = m_.tested[item(i) / static_cast<int>(kWidth)];
      met_[i] = 0;
      bool crossed = false;
      settled[i] = true;
      if (place_ball(probe_, 0, block.block, item(i) % static_cast<int>(kWidth), x[i], r[i])) {
        settled[i] = source_.settles(x[i], r[i], part[i]);
        std::uint32_t unclear = 0;
        if (!settled[i])
          crossed = meet(block.from, block.triangles, x[i], r[i], Share(item(i), !two_), met_[i],
                         unclear);
        if constexpr (Source::kCrossings)
          if (unclear != 0)
            crossed = crossed != crosses_odd(source_, block.from, x[i], m_.id, unclear);
      }
      touched |= team_.ballot(met_[i] != 0) << (i * Team::kWidth);
      odd |= team_.ballot(crossed) << (i * Team::kWidth);
    }
    constexpr std::uint32_t kHalf = (1u << kWidth) - 1;
    lists_ = touched != 0;
    if (!two_) {
      touched = (touched | touched >> kWidth) & kHalf;
      odd = (odd ^ odd >> kWidth) & kHalf;
    }
    odd_ = first_ ? odd : odd_ ^ odd;
    for (int i = 0; i < kItemsALane; ++i) {
      const bool is_ball = two_ || item(i) < static_cast<int>(kWidth);
      if (first_ && is_ball) m_.held_as[item(i)] = kNotHeld;
      const bool fresh =
          is_ball && (touched >> item(i) & 1) != 0 && (first_ || m_.held_as[item(i)] == kNotHeld);
      int total = 0;
      const int place = held_ + team_.exclusive_count(fresh, total);
      held_ += total;
      if (fresh) hold(place, item(i), x[i], r[i]);
      if (!last_) continue;
      const bool there = is_ball && r[i] > 0;
      bool inside;
      if constexpr (Source::kCrossings)
        inside =
            m_.tested[item(i) / static_cast<int>(kWidth)].inside != ((odd_ >> item(i) & 1) != 0);
      else
        inside = source_.inside(team_, there && !settled[i], x[i]);
      if (!there) continue;
      if (settled[i])
        add_settled(x[i], part[i]);
      else if (m_.held_as[item(i)] != kNotHeld)
        m_.inside[m_.held_as[item(i)]] = inside ? 1 : 0;
      else if (inside)
        add_ball(x[i], r[i], true, 0);
    }
    team_.sync();
  }

  /// Lists a triangle a ball; drain() has left room for it.
  IST_HD void list() {
    bool more = false;
    for (int i = 0; i < kItemsALane; ++i) {
      const bool meets = met_[i] != 0;
      int total = 0;
      const int place = near_ + team_.exclusive_count(meets, total);
      near_ += total;
      if (meets) {
        const int ball = two_ ? item(i) : item(i) % static_cast<int>(kWidth);
        m_.near[place] = {m_.held_as[ball], m_.id[lowest_bit(met_[i])]};
        met_[i] &= met_[i] - 1;
      }
      more = more || met_[i] != 0;
    }
    lists_ = team_.any(more);
    team_.sync();
  }

  /// Takes as much of what is listed as the team is wide, of the `rest` whatever is left; false if
  /// there is not as much. What came near is sorted: it misses, is summed, or waits among what
  /// edges cut.
  IST_HD bool drain(bool rest) {
    const bool of_cut = cut_ >= Team::kWidth || (rest && near_ == 0 && cut_ > 0);
    if (!of_cut && near_ < (rest ? 1 : Team::kWidth)) return false;
    const int listed = of_cut ? cut_ : near_;
    const int take = listed < Team::kWidth ? listed : Team::kWidth;
    const int left = listed - take;
    cut_ = of_cut ? left : cut_;
    near_ = of_cut ? near_ : left;
    DiscKind kind = DiscKind::apart;
    BallTriangle pair = {kNoBall, {0, 0}};
    DiscPart part = {0, 0, 0, 0};
    if (team_.lane() < take) {
      pair = (of_cut ? m_.cut : m_.near)[left + team_.lane()];
      const auto ball = static_cast<int>(pair.ball);
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]};
      const TrianglePlane t = plane_of(pair);
      const Disc disc(t, x, m_.r[ball]);
      kind = of_cut ? DiscKind::cut : disc.kind();
      if (!of_cut && disc.on_edge()) m_.on_edge[ball] = 1;
      if (of_cut || kind == DiscKind::whole) {
        part = of_cut ? disc.within_edges() : disc.whole();
        add_pull(t, x, part);
      }
    }
    if (!of_cut) {
      int total = 0;
      const int place = cut_ + team_.exclusive_count(kind == DiscKind::cut, total);
      if (kind == DiscKind::cut) m_.cut[place] = pair;
      cut_ += total;
      sums_.spheres += kind != DiscKind::apart ? 1 : 0;
    }
    share_out(of_cut || kind == DiscKind::whole ? pair.ball : kNoBall, part);
    return true;
  }

  IST_HD_COLD static bool crosses_odd(const Source source, const double (&from)[3],
                                      const double (&x)[3], const TriangleId* ids,
                                      std::uint32_t triangles) {
    bool odd = false;
    for (; triangles != 0; triangles &= triangles - 1)
      if (source.crosses(from, x, ids[lowest_bit(triangles)])) odd = !odd;
    return odd;
  }

  IST_HD void hold(int place, int of_item, const double (&x)[3], double r) {
    for (int k = 0; k < 3; ++k) m_.x[k][place] = x[k];
    m_.r[place] = r;
    m_.cones[place] = m_.angle[place] = 0;
    m_.on_edge[place] = 0;
    m_.held_as[of_item] = static_cast<std::uint8_t>(place);
  }

  IST_HD TrianglePlane plane_of(const BallTriangle& pair) const {
    double c[3][3];
    source_.corners(pair.triangle, c);
    return TrianglePlane(c);
  }

  /// From the probing tree's unit-frame origin.
  IST_HD void from_origin(const double (&x)[3], double (&at)[3]) const {
    for (int k = 0; k < 3; ++k) at[k] = x[k] - probe_.place.a_from_b.t[k];
  }

  /// What is linear in the surface: the lane's own sums.
  IST_HD void add_pull(const TrianglePlane& t, const double (&x)[3], const DiscPart& part) {
    double at[3], push[3], shift[3];
    from_origin(x, at);
    for (int k = 0; k < 3; ++k) {
      push[k] = -t.n[k] * part.area;
      shift[k] = -t.n[k] * (0.5 * part.second);
    }
    sums_.add(at, 0, push, shift);
  }

  /// Adds the lanes' cones and angles to their balls', in the order of the lanes.
  IST_HD void share_out(std::uint32_t of_ball, const DiscPart& part) {
    const bool shares = of_ball != kNoBall;
    std::uint32_t alike = team_.alike(of_ball);
    const bool leads = shares && lowest_bit(alike) == team_.lane();
    alike = leads ? alike : 0;
    double cones = 0, angle = 0;
    while (team_.any(alike != 0)) {
      const int from = alike != 0 ? lowest_bit(alike) : team_.lane();
      const double c = team_.broadcast(part.cones, from), a = team_.broadcast(part.angle, from);
      if (alike == 0) continue;
      cones += c;
      angle += a;
      alike &= alike - 1;
    }
    if (leads) {
      m_.cones[of_ball] += cones;
      m_.angle[of_ball] += angle;
    }
    team_.sync();
  }

  /// Cones, angle and side of a ball whose centre lies on an edge, from beside it: put_right()
  /// (query/probe/patch_sums.h).
  IST_HD_COLD static void put_right(const Team team, DiscMemory& m, const Source source, int ball) {
    const double r = m.r[ball];
    const double x[3] = {m.x[0][ball], m.x[1][ball], m.x[2][ball]};
    double moved[3] = {x[0], x[1], x[2]};
    DiscMemory::move(r, moved);
    double cones = 0, angle = 0, pull[3] = {0, 0, 0};
    source.each_near(team, x, r * (1 + kMoved), [&](bool there, const TriangleId& id) {
      if (!there) return;
      double c[3][3];
      source.corners(id, c);
      const TrianglePlane t(c);
      if (t.flat) return;
      const DiscPart here = Disc(t, x, r).part(), beside = Disc(t, moved, r).part();
      for (int k = 0; k < 3; ++k) pull[k] += t.n[k] * (here.area + beside.area);
      cones += beside.cones;
      angle += beside.angle;
    });
    double change = 0;
    for (int k = 0; k < 3; ++k) change += 0.5 * team.sum(pull[k]) * (DiscMemory::away(k) * r);
    cones = team.sum(cones);
    angle = team.sum(angle);
    const bool inside = source.inside(team, team.lane() == 0, moved);
    if (team.lane() == 0) {
      m.cones[ball] = cones + change;
      m.angle[ball] = angle;
      m.inside[ball] = inside ? 1 : 0;
    }
    team.sync();
  }

  IST_HD void add_settled(const double (&x)[3], const PartInside& part) {
    if (!(part.volume > 0)) return;
    double at[3];
    from_origin(x, at);
    sums_.add(at, part.volume, part.gradient, part.moment);
    ++sums_.spheres;
  }

  IST_HD void add_ball(const double (&x)[3], double r, bool inside, double cones) {
    const double whole = 4 * kPi / 3 * (r * r * r);
    const double part = (inside ? whole : 0) + cones;
    const double volume = part < 0 ? 0 : part > whole ? whole : part;
    const double none[3] = {0, 0, 0};
    double at[3];
    from_origin(x, at);
    sums_.add(at, volume, none, none);
    sums_.spheres += inside && cones == 0 ? 1 : 0;
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  const Team& team_;
  const ProbeMemory& probe_;
  DiscMemory& m_;
  const Source source_;
  PartSums& sums_;
  int held_ = 0;                    ///< balls
  std::uint32_t met_[kItemsALane];  ///< triangles that meet an item's ball and wait to be listed
  bool two_ = false, first_ = false, last_ = false;  ///< of what is tested
  bool tests_ = false, lists_ = false;               ///< something waits
  std::uint32_t odd_ = 0;   ///< balls that lie on the other side of what is known
  int near_ = 0, cut_ = 0;  ///< listed
};

}  // namespace ist::gpu
