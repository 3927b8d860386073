#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "cuda/query/ball_tests.h"
#include "query/asset/shared_constants.h"
#include "query/ball_triangle/disc.h"

// One team computes, for balls that triangles intersect, the exact part inside the closed surface,
// as add_patch() and total_of() do (query/ball_triangle/patch_sums.h, query/shape/patch_shapes.h).
// Discs that edges cut go to a list, so that all lanes of a warp work on the expensive case.

namespace ist::gpu {

constexpr std::uint32_t kNoBall = ~0u;
constexpr int kCutCapacity = 64;  ///< the rest of a round of a warp, and what a round may add
static_assert(kCutCapacity >= 2 * 32 - 1);

template <class Id>
struct BallTriangle {
  std::uint32_t ball;
  Id triangle;
};

template <class Id>
struct DiscMemory {
  double x[3][kHeldBalls], r[kHeldBalls];
  double cones[kHeldBalls], angle[kHeldBalls];
  std::uint32_t inside[kHeldBalls];  ///< true if the centre is inside
  std::uint32_t on_edge[kHeldBalls];
  BallTriangle<Id> cut[kCutCapacity];
};

/// Source: as described at BallTests.
template <class Team, class Source>
class DiscSums {
 public:
  using Id = typename Source::Id;

  IST_HD DiscSums(const Team& team, const ProbeMemory& probe, DiscMemory<Id>& memory,
                  const Source& source, PartSums& sums)
      : team_(team), probe_(probe), m_(memory), source_(source), sums_(sums) {}

  /// Sums the listed pairs and, at the `end` of a part, the kept balls; then the source's memory
  /// must be free. Several calls may belong to one part.
  IST_HD void add(const MetView<Id>& met, bool end) {
    load(met);
    int next = 0;
    for (;;) {
      const bool of_cut = cut_ >= Team::kWidth || (next == met.pair_count && cut_ > 0);
      if (!of_cut && next == met.pair_count) break;
      drain(met, of_cut, next);
    }
    if (end) finish(met);
  }

 private:
  /// Places the balls that were added since the last call.
  IST_HD void load(const MetView<Id>& met) {
    IST_ROLLED
    for (int ball = held_ + team_.lane(); ball < met.ball_count; ball += Team::kWidth) {
      const std::uint32_t number = met.balls[ball] & ~kCentreInside;
      double x[3];
      place_ball(probe_, 0, number / kWidth, static_cast<int>(number % kWidth), x, m_.r[ball]);
      for (int k = 0; k < 3; ++k) m_.x[k][ball] = x[k];
      m_.cones[ball] = m_.angle[ball] = 0;
      m_.on_edge[ball] = 0;
    }
    held_ = met.ball_count;
    team_.sync();
  }

  /// Takes a team's width of listed pairs, or the rest. A pair is discarded, summed, or listed
  /// again if edges cut its disc.
  IST_HD void drain(const MetView<Id>& met, bool of_cut, int& next) {
    const int listed = of_cut ? cut_ : met.pair_count - next;
    const int take = listed < Team::kWidth ? listed : Team::kWidth;
    const int first = of_cut ? cut_ - take : next;
    cut_ -= of_cut ? take : 0;
    next += of_cut ? 0 : take;
    DiscKind kind = DiscKind::apart;
    BallTriangle<Id> pair = {kNoBall, {}};
    DiscPart part = {0, 0, 0, 0};
    if (team_.lane() < take) {
      const int at = first + team_.lane();
      pair = of_cut ? m_.cut[at] : BallTriangle<Id>{met.of_ball[at], met.triangles[at]};
      const auto ball = static_cast<int>(pair.ball);
      const double x[3] = {m_.x[0][ball], m_.x[1][ball], m_.x[2][ball]};
      double c[3][3];
      source_.corners(pair.triangle, c);
      const TrianglePlane t(c);
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
  }

  /// Sums the kept balls, once no pair is listed.
  IST_HD void finish(const MetView<Id>& met) {
    for (int ball = team_.lane(); ball < held_; ball += Team::kWidth)
      m_.inside[ball] = met.balls[ball] >= kCentreInside ? 1 : 0;
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
      const bool told = std::fabs(angle) > kLeastAngle;
      add_ball(probe_.place.a_from_b, x, m_.r[ball], told ? angle < 0 : m_.inside[ball] != 0,
               m_.cones[ball], sums_);
    }
    held_ = 0;
    team_.sync();
  }

  /// Adds the terms that are linear in the surface to the lane's own sums.
  IST_HD void add_pull(const TrianglePlane& t, const double (&x)[3], const DiscPart& part) {
    double at[3], push[3], shift[3];
    for (int k = 0; k < 3; ++k) {
      at[k] = x[k] - probe_.place.a_from_b.t[k];
      push[k] = -t.n[k] * part.area;
      shift[k] = -t.n[k] * (0.5 * part.second);
    }
    sums_.add(at, 0, push, shift);
  }

  /// Adds the lanes' cones and angles to those of their balls, in the order of the lanes.
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

  /// Computes the cones, angle and side of a ball whose centre lies on an edge from a point beside
  /// it: put_right() (query/ball_triangle/patch_sums.h).
  IST_HD_COLD static void put_right(const Team team, DiscMemory<Id>& m, const Source source,
                                    int ball) {
    const double r = m.r[ball];
    const double x[3] = {m.x[0][ball], m.x[1][ball], m.x[2][ball]};
    double moved[3] = {x[0], x[1], x[2]};
    move_away(r, moved);
    double cones = 0, angle = 0, pull[3] = {0, 0, 0};
    source.each_near(team, x, r * (1 + kMoved), [&](bool there, const Id& id) {
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
    for (int k = 0; k < 3; ++k) change += 0.5 * team.sum(pull[k]) * (moved_along(k) * r);
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

  const Team& team_;
  const ProbeMemory& probe_;
  DiscMemory<Id>& m_;
  const Source source_;
  PartSums& sums_;
  int held_ = 0;  ///< balls that are placed
  int cut_ = 0;   ///< listed
};

}  // namespace ist::gpu
