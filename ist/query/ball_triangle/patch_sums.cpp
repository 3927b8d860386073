#include "query/ball_triangle/patch_sums.h"

#include <algorithm>
#include <cmath>

#include "base/bits.h"
#include "query/ball_triangle/disc.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/ball_triangle/patch_sums.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DiscTag = hn::CappedTag<double, 8>;
using Real = hn::Vec<DiscTag>;
HWY_INLINE Real constant(double x) { return hn::Set(DiscTag(), x); }
HWY_INLINE Real negated(Real x) { return hn::Zero(DiscTag()) - x; }
HWY_INLINE Real root(Real x) { return hn::Sqrt(x); }
HWY_INLINE Real lesser(Real x, Real y) { return hn::Min(x, y); }
HWY_INLINE Real greater(Real x, Real y) { return hn::Max(x, y); }
HWY_INLINE Real where_positive(Real x, Real y) {
  return hn::IfThenElse(x > hn::Zero(DiscTag()), y, constant(1.0));
}

/// atan2(y, x) in (−π, π], within a few units in the last place; 0 for the origin. Same bits on
/// every instruction set: only products, quotients and sums in this order.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V angle_of(D d, V y, V x) {
  // atan(t)/t as a polynomial in t² for 0 ≤ t ≤ tan(π/8), within 4e-17: interpolated at Chebyshev's
  // points with sixty digits.
  constexpr double kTerms[11] = {
      1.0,
      -0.3333333333332844,
      0.1999999999885511,
      -0.14285714180976467,
      0.11111106180455946,
      -0.09090773074808414,
      0.07689953496306857,
      -0.06640233930429408,
      0.056883492268090106,
      -0.04348052215716462,
      0.021135373157693246,
  };
  constexpr double kTanEighth = 0.41421356237309503;                     // tan(π/8)
  constexpr double kQuarter = 0.7853981633974483, kHalf = 2 * kQuarter;  // of π
  const V zero = hn::Zero(d);
  const V ax = hn::Abs(x), ay = hn::Abs(y);
  const V more = hn::Max(ax, ay), less = hn::Min(ax, ay);
  const auto wide = less > hn::Set(d, kTanEighth) * more;
  const V below = hn::IfThenElse(wide, more + less, more);
  const V t = hn::IfThenElse(wide, less - more, less) / hn::Max(below, hn::Set(d, 1e-300));
  const V t2 = t * t;
  // Even and odd terms in separate chains: half the latency.
  const V t4 = t2 * t2;
  V even = hn::Set(d, kTerms[10]), odd = hn::Set(d, kTerms[9]);
  for (int k = 8; k >= 0; k -= 2) even = even * t4 + hn::Set(d, kTerms[k]);
  for (int k = 7; k >= 1; k -= 2) odd = odd * t4 + hn::Set(d, kTerms[k]);
  V angle = t * (even + t2 * odd);
  angle = hn::IfThenElse(wide, hn::Set(d, kQuarter) + angle, angle);
  angle = hn::IfThenElse(ay > ax, hn::Set(d, kHalf) - angle, angle);
  angle = hn::IfThenElse(x < zero, hn::Set(d, 4 * kQuarter) - angle, angle);
  return hn::CopySignToAbs(angle, y);
}

#define IST_FORMULA HWY_INLINE
#include "query/ball_triangle/disc_formulas-inl.h"
#undef IST_FORMULA

/// A vector of centres: their heights over triangles' planes, and their feet in these.
template <class V>
struct Feet {
  V height, x, y;
};

/// A bit for each ball that comes near its triangle, which extends from `left` to `right` and from
/// 0 to `top` in its plane. kFeet: stores the feet, from `lane` on.
template <bool kFeet, class V>
HWY_INLINE std::uint32_t near_lanes(const Feet<V>& feet, V left, V right, V top, V r,
                                    std::size_t lane, double* height, double* x, double* y) {
  const LaneTag<double> d;
  const auto beside = hn::And(feet.x > left - r, feet.x < right + r);
  const auto along = hn::And(feet.y > hn::Zero(d) - r, feet.y < top + r);
  if constexpr (kFeet) {
    hn::Store(feet.height, d, height + lane);
    hn::Store(feet.x, d, x + lane);
    hn::Store(feet.y, d, y + lane);
  }
  return mask_bits(d, hn::And(hn::Abs(feet.height) < r, hn::And(beside, along)));
}

/// A bit for each ball that comes near triangle t. kFeet: stores heights and feet of all balls.
template <bool kFeet>
HWY_INLINE std::uint32_t feet_near(const SurfacePatch& patch, std::size_t t,
                                   const ProbeBalls& balls, double* height, double* x, double* y) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const auto of = [&](double value) -> V { return hn::Set(d, value); };
  V from[3], u[3], v[3], n[3];
  for (int k = 0; k < 3; ++k) {
    from[k] = of(patch.corner[0][k][t] - balls.origin[k]);
    u[k] = of(patch.u[k][t]), v[k] = of(patch.v[k][t]), n[k] = of(patch.n[k][t]);
  }
  const V left = of(patch.left[t]), right = of(patch.right[t]), top = of(patch.top[t]);
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V px = hn::Load(d, balls.x + lane) - from[0];
    const V py = hn::Load(d, balls.y + lane) - from[1];
    const V pz = hn::Load(d, balls.z + lane) - from[2];
    const V r = hn::Load(d, balls.r + lane);
    const auto dot = [&](const V(&axis)[3]) -> V {
      return (px * axis[0] + py * axis[1]) + pz * axis[2];
    };
    near |=
        near_lanes<kFeet>(Feet<V>{dot(n), dot(u), dot(v)}, left, right, top, r, lane, height, x, y)
        << lane;
  }
  return near;
}

/// A bit for each triangle that the ball comes near. kFeet: as for feet_near().
template <bool kFeet>
HWY_INLINE std::uint32_t feet_of(const SurfacePatch& patch, const double (&centre)[3],
                                 double radius, double* height, double* x, double* y) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const V r = hn::Set(d, radius);
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V px = hn::Set(d, centre[0]) - hn::Load(d, patch.corner[0][0] + lane);
    const V py = hn::Set(d, centre[1]) - hn::Load(d, patch.corner[0][1] + lane);
    const V pz = hn::Set(d, centre[2]) - hn::Load(d, patch.corner[0][2] + lane);
    const auto dot = [&](const double(&axis)[3][kWidth]) -> V {
      return (px * hn::Load(d, axis[0] + lane) + py * hn::Load(d, axis[1] + lane)) +
             pz * hn::Load(d, axis[2] + lane);
    };
    near |= near_lanes<kFeet>(Feet<V>{dot(patch.n), dot(patch.u), dot(patch.v)},
                              hn::Load(d, patch.left + lane), hn::Load(d, patch.right + lane),
                              hn::Load(d, patch.top + lane), r, lane, height, x, y)
            << lane;
  }
  return near;
}

std::uint32_t near_of(const SurfacePatch& patch, const double (&centre)[3], double radius) {
  return feet_of<false>(patch, centre, radius, nullptr, nullptr, nullptr);
}

void place_probes_of(const SphereTree& probes, int level, std::uint32_t block,
                     const Similarity& map, ProbeBalls& balls) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const NodeBall ball = probes.ball(level, block);
  const BallBlock& from = probes.level[level].blocks[block];
  const Origin& o = probes.level[level].origins[block];
  map.apply(ball.centre, balls.origin);
  balls.reach = ball.r * map.scale * (1 + 1e-12);
  V m[9];
  for (int k = 0; k < 9; ++k) m[k] = hn::Set(d, map.m[k]);
  const V ox = hn::Set(d, o.x - ball.centre[0]);
  const V oy = hn::Set(d, o.y - ball.centre[1]);
  const V oz = hn::Set(d, o.z - ball.centre[2]);
  const V scale = hn::Set(d, map.scale);
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V x = ox + load_as<double>(d, from.x + lane);
    const V y = oy + load_as<double>(d, from.y + lane);
    const V z = oz + load_as<double>(d, from.z + lane);
    hn::Store((m[0] * x + m[1] * y) + m[2] * z, d, balls.x + lane);
    hn::Store((m[3] * x + m[4] * y) + m[5] * z, d, balls.y + lane);
    hn::Store((m[6] * x + m[7] * y) + m[8] * z, d, balls.z + lane);
    hn::Store(hn::Max(load_as<double>(d, from.r + lane), hn::Zero(d)) * scale, d, balls.r + lane);
  }
}

void make_patch_of(const TriangleCorners& corners, SurfacePatch& patch) {
  const DiscTag d;
  const Real zero = hn::Zero(d), never = hn::Set(d, -1e300);
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    Real e[3], f[3];
    const auto load = [&](int k, const double(&of)[3][kWidth]) {
      const Real a = hn::Load(d, of[0] + lane);
      const Real b = hn::Load(d, of[1] + lane);
      const Real c = hn::Load(d, of[2] + lane);
      e[k] = b - a;
      f[k] = c - a;
      hn::Store(a, d, patch.corner[0][k] + lane);
      hn::Store(b, d, patch.corner[1][k] + lane);
      hn::Store(c, d, patch.corner[2][k] + lane);
    };
    load(0, corners.x), load(1, corners.y), load(2, corners.z);
    PlaneFrame frame;
    frame_of(e, f, frame);
    for (int k = 0; k < 3; ++k) {
      hn::Store(frame.u[k], d, patch.u[k] + lane);
      hn::Store(frame.v[k], d, patch.v[k] + lane);
      hn::Store(frame.n[k], d, patch.n[k] + lane);
      hn::Store(frame.length[k], d, patch.length[k] + lane);
      hn::Store(frame.edge_x[k], d, patch.edge_x[k] + lane);
      hn::Store(frame.edge_y[k], d, patch.edge_y[k] + lane);
    }
    const auto flat = hn::Not(frame.area > zero);
    hn::Store(hn::Min(zero, frame.apex_x), d, patch.left + lane);
    hn::Store(hn::IfThenElse(flat, never, hn::Max(frame.length[0], frame.apex_x)), d,
              patch.right + lane);
    hn::Store(hn::IfThenElse(flat, never, frame.apex_y), d, patch.top + lane);
  }
}

inline constexpr std::size_t kAtOnce = 64;
inline constexpr std::size_t kCapacity = kAtOnce + 8;

/// Members of DiscPart, for vectors of discs.
struct alignas(64) Shares {
  double cones[kCapacity], angle[kCapacity], area[kCapacity], second[kCapacity];
};

/// Discs that are computed in vectors: cut from side to side (chords), or with a corner inside.
struct alignas(64) DiscList {
  double h[kCapacity], r[kCapacity];  ///< height under the ball's centre, and the ball's radius
  /// Corners: the foot in the triangle's plane. Chords: x is the distance from the foot to the
  /// edge, > 0 if the foot is within.
  double x[kCapacity], y[kCapacity];
  std::int64_t triangle[kCapacity];
  std::uint32_t ball[kCapacity];
  double sign[kCapacity];
  Shares part;  ///< corners: within the triangle; chords: beyond the edge
  std::size_t size = 0;
};

HWY_INLINE void store(const DiscPart& from, std::size_t i, Shares& to) {
  const DiscTag d;
  hn::Store(from.cones, d, to.cones + i);
  hn::Store(from.angle, d, to.angle + i);
  hn::Store(from.area, d, to.area + i);
  hn::Store(from.second, d, to.second + i);
}

/// The segment beyond a chord is the sector over it without its triangle.
HWY_INLINE void measure_chords(DiscList& chords) {
  const DiscTag d;
  const Real zero = hn::Zero(d), two = hn::Set(d, 2.0);
  for (std::size_t i = 0; i < chords.size; i += hn::Lanes(d)) {
    const DiscShape disc = disc_shape(hn::Load(d, chords.h + i), hn::Load(d, chords.r + i));
    const Real m = hn::Load(d, chords.x + i);
    const Real half = hn::Sqrt(hn::Max(disc.rho2 - m * m, zero));
    const Real phi = two * angle_of(d, half, m);
    const Real omega = two * angle_of(d, m * half, (disc.h * disc.h + m * m) + disc.h * disc.r);
    DiscPart sums{zero, zero, zero, zero};
    add_triangle(disc, zero - omega, zero - m, zero - half, half, sums);
    add_sector(disc, phi, sums);
    store(sums, i, chords.part);
  }
}

/// Adds the part between the foot and an edge from t1 to t2.
HWY_INLINE void add_edge(const DiscShape& disc, Real m, Real t1, Real t2, DiscPart& sums) {
  const DiscTag d;
  const EdgeInDisc in = edge_in_disc(disc, m, t1, t2);
  add_sector(disc, angle_of(d, in.sectors_y, in.sectors_x), sums);
  add_triangle(disc, hn::Set(d, 2.0) * angle_of(d, in.half_y, in.half_x), m, in.low, in.high, sums);
}

HWY_INLINE void measure_corners(const SurfacePatch& patch, DiscList& corners) {
  const DiscTag d;
  const hn::RebindToSigned<DiscTag> di;
  const Real zero = hn::Zero(d);
  for (std::size_t i = 0; i < corners.size; i += hn::Lanes(d)) {
    const auto at = hn::Load(di, corners.triangle + i);
    const auto of = [&](const double* values) { return hn::GatherIndex(d, values, at); };
    const DiscShape disc = disc_shape(hn::Load(d, corners.h + i), hn::Load(d, corners.r + i));
    const Real x = hn::Load(d, corners.x + i), y = hn::Load(d, corners.y + i);
    DiscPart sums{zero, zero, zero, zero};
    const Real px = of(patch.length[0]) - x;
    add_edge(disc, y, zero - x, px, sums);
    const Real ex1 = of(patch.edge_x[1]), ey1 = of(patch.edge_y[1]), t1 = px * ex1 - y * ey1;
    add_edge(disc, px * ey1 + y * ex1, t1, t1 + of(patch.length[1]), sums);
    const Real ex2 = of(patch.edge_x[2]), ey2 = of(patch.edge_y[2]),
               t2 = zero - (x * ex2 + y * ey2);
    add_edge(disc, y * ex2 - x * ey2, t2 - of(patch.length[2]), t2, sums);
    store(sums, i, corners.part);
  }
}

/// Adds a part of triangle t's plane in ball b.
HWY_INLINE void add_part(const SurfacePatch& patch, std::size_t t, std::size_t b, double sign,
                         const disc::DiscPart& part, ProbeSums& sums) {
  sums.cones[b] += sign * part.cones;
  sums.angle[b] += sign * part.angle;
  sums.area[b] += part.area;
  for (int k = 0; k < 3; ++k) {
    sums.pull[k][b] += patch.n[k][t] * part.area;
    sums.shift[k][b] += patch.n[k][t] * (0.5 * part.second);
  }
}

/// Fills the lanes after the last entry with finite numbers.
HWY_INLINE void fill_up(DiscList& list) {
  for (std::size_t i = list.size; i < (list.size + 7) / 8 * 8; ++i) {
    list.h[i] = list.x[i] = list.y[i] = 0;
    list.r[i] = 1;
    list.triangle[i] = 0;
  }
}

/// Adds the computed parts, times `factor`, and empties the list.
HWY_INLINE void add_parts(const SurfacePatch& patch, double factor, DiscList& list,
                          ProbeSums& sums) {
  const Shares& part = list.part;
  for (std::size_t i = 0; i < list.size; ++i)
    add_part(patch, static_cast<std::size_t>(list.triangle[i]), list.ball[i], list.sign[i],
             {factor * part.cones[i], factor * part.angle[i], factor * part.area[i],
              factor * part.second[i]},
             sums);
  list.size = 0;
}

HWY_NOINLINE void take_chords(const SurfacePatch& patch, DiscList& chords, ProbeSums& sums) {
  fill_up(chords);
  measure_chords(chords);
  add_parts(patch, -1, chords, sums);
}

HWY_NOINLINE void take_corners(const SurfacePatch& patch, DiscList& corners, ProbeSums& sums) {
  fill_up(corners);
  measure_corners(patch, corners);
  add_parts(patch, 1, corners, sums);
}

/// Classifies a ball near a triangle: the ball misses it, its disc lies within, edges cut the disc
/// from side to side, or the disc contains a corner.
HWY_INLINE void sort_disc(const SurfacePatch& patch, std::size_t t, std::size_t b, double height,
                          double x, double y, double r, DiscList& chords, DiscList& corners,
                          ProbeSums& sums) {
  double length[3], edge_x[3], edge_y[3];
  for (int k = 0; k < 3; ++k) {
    length[k] = patch.length[k][t];
    edge_x[k] = patch.edge_x[k][t];
    edge_y[k] = patch.edge_y[k][t];
  }
  const Disc disc(height, x, y, r, length, edge_x, edge_y);
  if (disc.on_edge()) sums.on_edge |= 1u << b;
  const Disc::Crossings found = disc.crossings();
  if (found.is_apart) return;
  sums.meet(b);
  ++sums.pairs;
  const auto append = [&](DiscList& list, double at_x, double at_y) {
    const std::size_t i = list.size++;
    list.h[i] = std::abs(height), list.r[i] = r;
    list.x[i] = at_x, list.y[i] = at_y;
    list.triangle[i] = static_cast<std::int64_t>(t);
    list.ball[i] = static_cast<std::uint32_t>(b);
    list.sign[i] = height > 0 ? 1 : -1;
    return list.size == kAtOnce;
  };
  if (found.has_corner) {
    if (append(corners, x, y)) take_corners(patch, corners, sums);
    return;
  }
  // The disc contains no corner: it is whole without the segments that edges cut off, or outside.
  if (found.through == 0 && found.is_outside) return;
  add_part(patch, t, b, 1, disc.whole(), sums);
  for (int k = 0; k < 3; ++k)
    if ((found.through >> k & 1) != 0 && append(chords, disc.distance(k), 0))
      take_chords(patch, chords, sums);
}

void add_patch_to(const SurfacePatch& patch, std::uint32_t triangles, const ProbeBalls& balls,
                  std::uint32_t chosen, ProbeSums& sums) {
  DiscList chords, corners;
  alignas(64) double height[kWidth], x[kWidth], y[kWidth];
  if (hwy::PopCount(triangles) <= hwy::PopCount(chosen)) {
    for (const std::uint32_t t : set_bits(triangles)) {
      for (const std::uint32_t b :
           set_bits(chosen & feet_near<true>(patch, t, balls, height, x, y)))
        sort_disc(patch, t, b, height[b], x[b], y[b], balls.r[b], chords, corners, sums);
    }
  } else {
    for (const std::uint32_t b : set_bits(chosen)) {
      const double centre[3] = {balls.origin[0] + balls.x[b], balls.origin[1] + balls.y[b],
                                balls.origin[2] + balls.z[b]};
      for (const std::uint32_t t :
           set_bits(triangles & feet_of<true>(patch, centre, balls.r[b], height, x, y)))
        sort_disc(patch, t, b, height[t], x[t], y[t], balls.r[b], chords, corners, sums);
    }
  }
  if (chords.size > 0) take_chords(patch, chords, sums);
  if (corners.size > 0) take_corners(patch, corners, sums);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(add_patch_to);
HWY_EXPORT(make_patch_of);
HWY_EXPORT(near_of);
HWY_EXPORT(place_probes_of);

void place_probes(const SphereTree& probes, int level, std::uint32_t block, const Similarity& map,
                  ProbeBalls& balls) noexcept {
  HWY_DYNAMIC_DISPATCH(place_probes_of)(probes, level, block, map, balls);
}

std::uint32_t triangles_near(const SurfacePatch& patch, const double (&centre)[3],
                             double radius) noexcept {
  return HWY_DYNAMIC_DISPATCH(near_of)(patch, centre, radius);
}

void make_patch(const TriangleCorners& corners, SurfacePatch& patch) noexcept {
  HWY_DYNAMIC_DISPATCH(make_patch_of)(corners, patch);
}

ProbeBalls away_from_edges(const ProbeBalls& balls, std::uint32_t chosen) noexcept {
  ProbeBalls moved = balls;
  double most = 0;
  for (std::size_t i = 0; i < kWidth; ++i) {
    if ((chosen >> i & 1) == 0) {
      moved.r[i] = 0;
      continue;
    }
    moved.x[i] += moved_along(0) * balls.r[i];
    moved.y[i] += moved_along(1) * balls.r[i];
    moved.z[i] += moved_along(2) * balls.r[i];
    most = std::max(most, balls.r[i]);
  }
  moved.reach += kMoved * most;
  return moved;
}

void put_right(const ProbeSums& moved, const ProbeBalls& balls, ProbeSums& sums) noexcept {
  for (std::size_t i = 0; i < kWidth; ++i) {
    if ((sums.on_edge >> i & 1) == 0) continue;
    double change = 0;  // of the volume, when the ball moves back
    for (int k = 0; k < 3; ++k)
      change += 0.5 * (sums.pull[k][i] + moved.pull[k][i]) * (moved_along(k) * balls.r[i]);
    sums.cones[i] = moved.cones[i] + change;
    sums.angle[i] = moved.angle[i];
  }
}

void add_patch(const SurfacePatch& patch, std::uint32_t triangles, const ProbeBalls& balls,
               std::uint32_t chosen, ProbeSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(add_patch_to)(patch, triangles, balls, chosen, sums);
}

}  // namespace ist
#endif
