#pragma once

#include <cstdint>

#include "cuda/query/bits.h"
#include "cuda/query/disc_part.h"
#include "cuda/query/part_sums.h"
#include "cuda/query/seen_triangles.h"
#include "numerics/host_device.h"

// Balls met by triangles, by one team: their parts inside the closed surface, exactly, as
// add_patch() and total_of() (query/probe/patch_sums.h, query/field/probe_sum.h) have them. Eight
// blocks of sixteen balls are held at a time, and what meets goes to lists, so that the lanes of a
// warp are full where the work is.

namespace ist::gpu {

constexpr int kHeldBlocks = 8;
constexpr int kHeldBalls = kHeldBlocks * static_cast<int>(kWidth);
constexpr int kKeptNear = 16;  ///< triangles near a block that are remembered
constexpr int kDiscRoom = 64;  ///< what is left after a round of a warp, and what a round may add
static_assert(kDiscRoom >= 2 * 32 - 1 && kHeldBalls % 32 == 0);
static_assert(2 * static_cast<int>(kWidth) <= kStaged);  // two blocks of triangles
constexpr std::uint32_t kNoBall = ~0u;
/// A ball is moved by less than this part of its radius where its centre lies on an edge: what
/// comes near its block is looked for that much further out.
constexpr double kMoved = 0x1p-10;

/// A triangle by whatever its source calls it.
struct TriangleId {
  std::uint32_t a, b;
};

struct BallTriangle {
  std::uint32_t ball;
  TriangleId triangle;
};

/// A block of balls in work, the field's frame.
struct HeldBlock {
  double centre[3], reach;  ///< all balls lie within
  std::uint32_t near;       ///< triangles that come near
  std::uint32_t known;      ///< a ball whose side is known, kNoBall: none yet
  bool known_inside;
  TriangleId kept[kKeptNear];  ///< the first of those near
};

struct DiscMemory {
  double x[3][kHeldBalls], r[kHeldBalls];  ///< r: 0 if there is no ball
  double cones[kHeldBalls], angle[kHeldBalls];
  std::uint32_t on_edge[kHeldBalls];
  HeldBlock block[kHeldBlocks];
  SeenTriangles triangles;
  TriangleId staged[kStaged];
  std::uint32_t staged_as[kStaged];  ///< its place in what is seen
  SeenBall ball_seen[kWidth];        ///< of the block that is tested
  BallTriangle near[kDiscRoom], cut[kDiscRoom];

  /// Where a ball's side is told: its centre, or beside it where that lies on an edge.
  IST_HD void seen(int ball, double (&at)[3]) const {
    for (int k = 0; k < 3; ++k) at[k] = x[k][ball];
    if (on_edge[ball] != 0) move(r[ball], at);
  }

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

/// Source: what has the triangles.
///   corners(id, x, reach, c): of a triangle, which may be another one for another ball
///   each_near(team, x, reach, visit): visit(there, id) by all lanes for all triangles near a ball
///   inside(team, memory, ball, wanted): whether a lane's ball has its centre inside
///
/// Blocks are held, triangles staged and tested against them, and what meets is drained, a round at
/// a time by a loop of the caller's, so that each step is in a kernel's code once:
///
///   if (drain(rest)) continue;
///   if (rest) finish();  // and go on to what comes next
///   if (tests()) test(); else …  // hold() and stage more, or set `rest`
template <class Team, class Source>
class DiscSums {
 public:
  IST_HD DiscSums(const Team& team, DiscMemory& memory, const Source& source,
                  const double (&origin)[3], PartSums& sums)
      : team_(team), m_(memory), source_(source), sums_(sums) {
    for (int k = 0; k < 3; ++k) origin_[k] = origin[k];
  }

  /// No block more can be held until finish().
  IST_HD bool full() const { return held_ == kHeldBlocks; }

  /// Room for a block whose balls lie within `reach` of `centre`; they are set next.
  IST_HD int hold(const double (&centre)[3], double reach) {
    const int slot = held_++;
    if (team_.lane() == 0) {
      HeldBlock& block = m_.block[slot];
      for (int k = 0; k < 3; ++k) block.centre[k] = centre[k];
      block.reach = reach * (1 + kMoved);
      block.near = 0;
    }
    return slot;
  }

  IST_HD void set_ball(int slot, int lane, const double (&x)[3], double r) {
    const int ball = slot * static_cast<int>(kWidth) + lane;
    for (int k = 0; k < 3; ++k) m_.x[k][ball] = x[k];
    m_.r[ball] = r;
    m_.cones[ball] = m_.angle[ball] = 0;
    m_.on_edge[ball] = 0;
  }

  /// Stages those of up to kStaged triangles that come near a held block, to be tested against it:
  /// id_of(k, id) says whether there is a k-th.
  template <class IdOf>
  IST_HD void stage_near(int slot, const IdOf& id_of) {
    const HeldBlock& block = m_.block[slot];
    int staged = 0;
    for (int i = 0; i < kStaged / Team::kWidth; ++i) {
      const int k = i * Team::kWidth + team_.lane();
      TriangleId id = {};
      bool near = id_of(k, id);
      if (near) {
        double c[3][3];
        source_.corners(id, block.centre, block.reach, c);
        near = m_.triangles.see(k, c, block.centre, block.reach);
      }
      int total = 0;
      const int place = staged + team_.exclusive_count(near, total);
      staged += total;
      if (near) stage(place, id, k);
    }
    ready_tests(slot, staged, block.centre, block.reach);
  }

  /// Makes a triangle the next to be tested, by the lane that knows it. `as`: its place in what is
  /// seen.
  IST_HD void stage(int place, const TriangleId& id, int as) {
    m_.staged[place] = id;
    m_.staged_as[place] = static_cast<std::uint32_t>(as);
  }

  /// Readies the tests of a held block with all that is staged: the triangles that come near it, as
  /// they are seen from a point that its balls lie within a reach of.
  IST_HD void ready_tests(int slot, int staged, const double (&centre)[3], double reach) {
    team_.sync();
    HeldBlock& block = m_.block[slot];
    const std::uint32_t before = block.near;
    for (int k = team_.lane(); k < staged; k += Team::kWidth)
      if (before + static_cast<std::uint32_t>(k) < kKeptNear)
        block.kept[before + static_cast<std::uint32_t>(k)] = m_.staged[k];
    for (int lane = team_.lane(); lane < static_cast<int>(kWidth); lane += Team::kWidth) {
      const int ball = slot * static_cast<int>(kWidth) + lane;
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]};
      m_.ball_seen[lane] = SeenTriangles::ball(x, m_.r[ball], centre, reach);
    }
    team_.sync();
    if (team_.lane() == 0) block.near = before + static_cast<std::uint32_t>(staged);
    tested_ = slot;
    test_ = 0;
    tests_ = staged * static_cast<int>(kWidth);
  }

  /// Whether tests are left.
  IST_HD bool tests() const { return test_ < tests_; }

  /// Tests a ball and a triangle a lane until none is left or a team's worth may meet and is
  /// listed; drain() has left room for it.
  IST_HD void test() {
    IST_ROLLED
    do {
      const int k = test_ + team_.lane();
      const int ball = k % static_cast<int>(kWidth);
      const int triangle = k < tests_ ? k / static_cast<int>(kWidth) : 0;
      const bool meets = k < tests_ && m_.triangles.meets(static_cast<int>(m_.staged_as[triangle]),
                                                          m_.ball_seen[ball]);
      int total = 0;
      const int place = near_ + team_.exclusive_count(meets, total);
      if (meets)
        m_.near[place] = {static_cast<std::uint32_t>(tested_ * static_cast<int>(kWidth) + ball),
                          m_.staged[triangle]};
      near_ += total;
      test_ += Team::kWidth;
    } while (tests() && near_ < Team::kWidth);
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

  /// Sums what is held: nothing is listed any more.
  IST_HD void finish() {
    team_.sync();
    for (int ball = 0; ball < held_ * static_cast<int>(kWidth); ball += Team::kWidth) {
      bool on_edge = m_.on_edge[ball + team_.lane()] != 0 &&
                     ball + team_.lane() < held_ * static_cast<int>(kWidth);
      for (;;) {
        int total = 0;
        const int lane = team_.first(on_edge, total);
        if (total == 0) break;
        put_right(team_, m_, source_, ball + lane);
        if (lane == team_.lane()) on_edge = false;
      }
    }
    source_.ready_sides(team_, m_, held_);
    IST_ROLLED
    for (int base = 0; base < held_ * static_cast<int>(kWidth); base += Team::kWidth) {
      const int ball = base + team_.lane();
      const bool there = ball < held_ * static_cast<int>(kWidth) && m_.r[ball] > 0;
      const double angle = there ? m_.angle[ball] : 0;
      const bool told = size_of(angle) > kLeastAngle;
      const bool otherwise = source_.inside(team_, m_, ball, there && !told);
      if (there) add_ball(ball, told ? angle < 0 : otherwise);
    }
    held_ = 0;
    team_.sync();
  }

  static constexpr double kLeastAngle = 1e-6;  ///< as query/field/probe_sum.h

 private:
  /// The triangle as it was when its block met it.
  IST_HD TrianglePlane plane_of(const BallTriangle& pair) const {
    const HeldBlock& block = m_.block[pair.ball / kWidth];
    double c[3][3];
    source_.corners(pair.triangle, block.centre, block.reach, c);
    return TrianglePlane(c);
  }

  /// What is linear in the surface: the lane's own sums.
  IST_HD void add_pull(const TrianglePlane& t, const double (&x)[3], const DiscPart& part) {
    const double at[3] = {x[0] - origin_[0], x[1] - origin_[1], x[2] - origin_[2]};
    double push[3], shift[3];
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

  /// Cones and angle of a ball whose centre lies on an edge, from beside it: put_right()
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
      source.corners(id, x, r * (1 + kMoved), c);
      const TrianglePlane t(c);
      const DiscPart here = Disc(t, x, r).part(), beside = Disc(t, moved, r).part();
      for (int k = 0; k < 3; ++k) pull[k] += t.n[k] * (here.area + beside.area);
      cones += beside.cones;
      angle += beside.angle;
    });
    double change = 0;
    for (int k = 0; k < 3; ++k) change += 0.5 * team.sum(pull[k]) * (DiscMemory::away(k) * r);
    cones = team.sum(cones);
    angle = team.sum(angle);
    if (team.lane() == 0) {
      m.cones[ball] = cones + change;
      m.angle[ball] = angle;
    }
    team.sync();
  }

  IST_HD void add_ball(int ball, bool inside) {
    const double r = m_.r[ball], cones = m_.cones[ball];
    const double whole = 4 * kPi / 3 * (r * r * r);
    const double part = (inside ? whole : 0) + cones;
    const double volume = part < 0 ? 0 : part > whole ? whole : part;
    const double at[3] = {m_.x[0][ball] - origin_[0], m_.x[1][ball] - origin_[1],
                          m_.x[2][ball] - origin_[2]};
    const double none[3] = {0, 0, 0};
    sums_.add(at, volume, none, none);
    sums_.spheres += inside && cones == 0 ? 1 : 0;
  }

  const Team& team_;
  DiscMemory& m_;
  const Source source_;
  PartSums& sums_;
  double origin_[3];          ///< of the probing tree
  int held_ = 0;              ///< blocks
  int tested_ = 0;            ///< the block that is
  int test_ = 0, tests_ = 0;  ///< made, and to be made
  int near_ = 0, cut_ = 0;    ///< listed
};

}  // namespace ist::gpu
