#include "query/ball_triangle/patch_sums.h"

#include <algorithm>
#include <cmath>

#include "query/ball_triangle/disc.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/ball_triangle/patch_sums.cpp"
#include <hwy/foreach_target.h>

#include "query/ball_triangle/disc_lanes-inl.h"
#include "query/ball_triangle/feet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

inline constexpr std::size_t kAtOnce = 64;
inline constexpr std::size_t kCapacity = kAtOnce + 8;

/// Members of DiscPart, for vectors of discs.
struct alignas(64) Shares {
  double cones[kCapacity], angle[kCapacity], area[kCapacity], second[kCapacity];
};

/// Discs that are computed a vector at a time: those that an edge cuts from side to side (chords),
/// or those that contain a corner.
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

/// Lanes beyond the last must be numbers.
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

/// Classifies a ball near a triangle: it misses it, its disc lies within, edges cut the disc from
/// side to side, or the disc contains a corner.
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
    for (; triangles != 0; triangles &= triangles - 1) {
      const std::size_t t = hwy::Num0BitsBelowLS1Bit_Nonzero32(triangles);
      std::uint32_t near = chosen & feet_near<true>(patch, t, balls, height, x, y);
      for (; near != 0; near &= near - 1) {
        const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero32(near);
        sort_disc(patch, t, b, height[b], x[b], y[b], balls.r[b], chords, corners, sums);
      }
    }
  } else {
    for (; chosen != 0; chosen &= chosen - 1) {
      const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero32(chosen);
      const double centre[3] = {balls.origin[0] + balls.x[b], balls.origin[1] + balls.y[b],
                                balls.origin[2] + balls.z[b]};
      std::uint32_t near = triangles & feet_of<true>(patch, centre, balls.r[b], height, x, y);
      for (; near != 0; near &= near - 1) {
        const std::size_t t = hwy::Num0BitsBelowLS1Bit_Nonzero32(near);
        sort_disc(patch, t, b, height[t], x[t], y[t], balls.r[b], chords, corners, sums);
      }
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
