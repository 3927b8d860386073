#pragma once

#include <cstdint>

#include "cuda/query/disc_part.h"
#include "cuda/query/part_sums.h"
#include "cuda/query/seen_triangles.h"
#include "numerics/host_device.h"

// Balls met by triangles, by one team: their parts inside the closed surface, exactly, as
// add_patch() and total_of() (query/probe/patch_sums.h, query/field/probe_sum.h) have them. Four
// blocks of sixteen balls are held at a time, and what meets goes to lists, so that the lanes of a
// warp are full where the work is.

namespace ist::gpu {

constexpr int kHeldBlocks = 4;
constexpr int kHeldBalls = kHeldBlocks * static_cast<int>(kWidth);
constexpr int kKeptNear = 16;  ///< triangles near a block that are remembered
constexpr int kDiscRoom = 64;
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
  SeenTriangles seen_from_block;
  TriangleId staged[kStaged];
  std::uint32_t staged_as[kStaged];  ///< its place in what is seen
  BallTriangle near[kDiscRoom], cut[kDiscRoom];
  double share[2][32];  ///< of the lanes: cones and angle
  std::uint32_t share_ball[32];

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

  /// Puts a held block together with up to kStaged triangles: id_of(k, id) says whether there is a
  /// k-th.
  template <class IdOf>
  IST_HD void meet(int slot, const IdOf& id_of) {
    const HeldBlock& block = m_.block[slot];
    int staged = 0;
    for (int i = 0; i < kStaged / Team::kWidth; ++i) {
      TriangleId id = {};
      float seen[SeenTriangles::kNumbers];
      const bool near = id_of(i * Team::kWidth + team_.lane(), id) && see(block, id, seen);
      int total = 0;
      const int place = staged + team_.exclusive_count(near, total);
      staged += total;
      if (!near) continue;
      stage(place, id, place);
      m_.seen_from_block.set(place, seen);
    }
    meet_staged(slot, staged, m_.seen_from_block, block.centre, block.reach);
  }

  /// Makes a triangle the next for meet_staged(), by the lane that knows it. `as`: its place in
  /// what is seen.
  IST_HD void stage(int place, const TriangleId& id, int as) {
    m_.staged[place] = id;
    m_.staged_as[place] = static_cast<std::uint32_t>(as);
  }

  /// Puts a held block together with all that is staged: the triangles that come near it, as they
  /// are seen from a point that its balls lie within a reach of.
  IST_HD_ONCE void meet_staged(int slot, int staged, const SeenTriangles& seen,
                               const double (&centre)[3], double reach) {
    team_.sync();
    HeldBlock& block = m_.block[slot];
    const std::uint32_t before = block.near;
    for (int k = team_.lane(); k < staged; k += Team::kWidth)
      if (before + static_cast<std::uint32_t>(k) < kKeptNear)
        block.kept[before + static_cast<std::uint32_t>(k)] = m_.staged[k];
    team_.sync();
    if (team_.lane() == 0) block.near = before + static_cast<std::uint32_t>(staged);
    const int tests = staged * static_cast<int>(kWidth);
    for (int base = 0; base < tests; base += Team::kWidth) {
      const int k = base + team_.lane();
      const int ball = slot * static_cast<int>(kWidth) + k % static_cast<int>(kWidth);
      const int triangle = k / static_cast<int>(kWidth);
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]};
      const bool meets =
          k < tests && m_.r[ball] > 0 &&
          seen.meets(static_cast<int>(m_.staged_as[triangle]), x, m_.r[ball], centre, reach);
      int total = 0;
      const int place = near_ + team_.exclusive_count(meets, total);
      if (meets) m_.near[place] = {static_cast<std::uint32_t>(ball), m_.staged[triangle]};
      near_ += total;
      team_.sync();
      drain(Team::kWidth);
    }
    team_.sync();
  }

  /// Sums what is held.
  IST_HD void finish() {
    team_.sync();
    drain(0);
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
  IST_HD bool see(const HeldBlock& block, const TriangleId& id,
                  float (&seen)[SeenTriangles::kNumbers]) const {
    double c[3][3];
    source_.corners(id, block.centre, block.reach, c);
    return SeenTriangles::see(c, block.centre, block.reach, seen);
  }

  /// Takes what is listed, as many at a time as the team is wide, until fewer than `full` are left;
  /// of 0 all. What came near is sorted: it misses, is summed, or waits among what edges cut.
  IST_HD_ONCE void drain(int full) {
    for (;;) {
      const bool of_cut = cut_ >= Team::kWidth || (full == 0 && near_ == 0 && cut_ > 0);
      if (!of_cut && (near_ == 0 || near_ < full)) return;
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
      const bool shares = of_cut || kind == DiscKind::whole;
      share_out(shares ? pair.ball : kNoBall, part);
    }
  }

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
    if (!team_.any(of_ball != kNoBall)) {
      team_.sync();
      return;
    }
    m_.share[0][team_.lane()] = part.cones;
    m_.share[1][team_.lane()] = part.angle;
    m_.share_ball[team_.lane()] = of_ball;
    team_.sync();
    for (int ball = team_.lane(); ball < kHeldBalls; ball += Team::kWidth) {
      double cones = 0, angle = 0;
      for (int i = 0; i < Team::kWidth; ++i) {
        if (m_.share_ball[i] != static_cast<std::uint32_t>(ball)) continue;
        cones += m_.share[0][i];
        angle += m_.share[1][i];
      }
      m_.cones[ball] += cones;
      m_.angle[ball] += angle;
    }
    team_.sync();
  }

  /// Cones and angle of a ball whose centre lies on an edge, from beside it: put_right()
  /// (query/probe/patch_sums.h).
  IST_HD_ONCE static void put_right(const Team& team, DiscMemory& m, const Source source,
                                    int ball) {
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
  double origin_[3];  ///< of the probing tree
  int held_ = 0;      ///< blocks
  int near_ = 0, cut_ = 0;
};

}  // namespace ist::gpu
