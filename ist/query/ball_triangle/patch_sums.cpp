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
inline constexpr std::size_t kRoom = kAtOnce + 8;

/// Volume between surface and sphere, solid angle, area and ∫ (ρ² − |y|²) dA of parts of discs.
struct alignas(64) Shares {
  double cones[kRoom], angle[kRoom], area[kRoom], second[kRoom];
};

/// Discs that an edge cuts from side to side.
struct alignas(64) Chords {
  double h[kRoom], r[kRoom];  ///< height under the ball's centre and its radius
  double m[kRoom];            ///< from the foot to the edge, > 0 if the foot is within
  std::uint32_t ball[kRoom];
  std::uint32_t triangle[kRoom];
  double sign[kRoom];
  Shares lost;  ///< beyond the edge
  std::size_t size = 0;
};

/// Discs that contain a corner.
struct alignas(64) Corners {
  double h[kRoom], r[kRoom];
  double x[kRoom], y[kRoom];  ///< the foot in the triangle's plane
  std::int64_t triangle[kRoom];
  std::uint32_t ball[kRoom];
  double sign[kRoom];
  Shares kept;  ///< within the triangle
  std::size_t size = 0;
};

HWY_INLINE void store(const DiscPart& from, std::size_t i, Shares& to) {
  const DiscTag d;
  hn::Store(from.cones, d, to.cones + i);
  hn::Store(from.angle, d, to.angle + i);
  hn::Store(from.area, d, to.area + i);
  hn::Store(from.second, d, to.second + i);
}

/// The segments beyond the chords: the sector over a chord without its triangle.
HWY_INLINE void measure_chords(Chords& chords) {
  const DiscTag d;
  const Real zero = hn::Zero(d), two = hn::Set(d, 2.0);
  for (std::size_t i = 0; i < chords.size; i += hn::Lanes(d)) {
    const DiscShape disc = disc_shape(hn::Load(d, chords.h + i), hn::Load(d, chords.r + i));
    const Real m = hn::Load(d, chords.m + i);
    const Real half = hn::Sqrt(hn::Max(disc.rho2 - m * m, zero));
    const Real phi = two * angle_of(d, half, m);
    const Real omega = two * angle_of(d, m * half, (disc.h * disc.h + m * m) + disc.h * disc.r);
    DiscPart sums{zero, zero, zero, zero};
    add_triangle(disc, zero - omega, zero - m, zero - half, half, sums);
    add_sector(disc, phi, sums);
    store(sums, i, chords.lost);
  }
}

/// The part between the foot and an edge that goes from t1 to t2.
HWY_INLINE void add_edge(const DiscShape& disc, Real m, Real t1, Real t2, DiscPart& sums) {
  const DiscTag d;
  const EdgeInDisc in = edge_in_disc(disc, m, t1, t2);
  add_sector(disc, angle_of(d, in.sectors_y, in.sectors_x), sums);
  add_triangle(disc, hn::Set(d, 2.0) * angle_of(d, in.half_y, in.half_x), m, in.low, in.high, sums);
}

HWY_INLINE void measure_corners(const SurfacePatch& patch, Corners& corners) {
  const DiscTag d;
  const hn::RebindToSigned<DiscTag> di;
  const Real zero = hn::Zero(d);
  for (std::size_t i = 0; i < corners.size; i += hn::Lanes(d)) {
    const auto at = hn::Load(di, corners.triangle + i);
    const auto of = [&](const double* values) { return hn::GatherIndex(d, values, at); };
    const DiscShape disc = disc_shape(hn::Load(d, corners.h + i), hn::Load(d, corners.r + i));
    const Real x = hn::Load(d, corners.x + i), y = hn::Load(d, corners.y + i);
    DiscPart sums{zero, zero, zero, zero};
    const Real base = of(patch.length[0]);
    add_edge(disc, y, zero - x, base - x, sums);
    const auto other = [&](int k, Real px) {
      const Real ex = of(patch.edge_x[k]), ey = of(patch.edge_y[k]);
      const Real t = px * ex - y * ey;
      add_edge(disc, px * ey + y * ex, t, t + of(patch.length[k]), sums);
    };
    other(1, base - x);
    // The third edge ends in the first corner.
    const Real ex = of(patch.edge_x[2]), ey = of(patch.edge_y[2]);
    const Real t = zero - (x * ex + y * ey);
    add_edge(disc, y * ex - x * ey, t - of(patch.length[2]), t, sums);
    store(sums, i, corners.kept);
  }
}

/// Adds `share` of triangle t inside ball b.
HWY_INLINE void add_share(const SurfacePatch& patch, std::size_t t, std::size_t b, double sign,
                          double cones, double angle, double area, double second, ProbeSums& sums) {
  sums.cones[b] += sign * cones;
  sums.angle[b] += sign * angle;
  sums.area[b] += area;
  for (int k = 0; k < 3; ++k) {
    sums.pull[k][b] += patch.n[k][t] * area;
    sums.shift[k][b] += patch.n[k][t] * (0.5 * second);
  }
}

/// Lanes beyond the last must be numbers.
template <class List>
HWY_INLINE std::size_t fill_up(List& list) {
  const std::size_t end = (list.size + 7) / 8 * 8;
  for (std::size_t i = list.size; i < end; ++i) {
    list.h[i] = 0;
    list.r[i] = 1;
    list.triangle[i] = 0;
  }
  return end;
}

HWY_NOINLINE void take_chords(const SurfacePatch& patch, Chords& chords, ProbeSums& sums) {
  const std::size_t end = fill_up(chords);
  for (std::size_t i = chords.size; i < end; ++i) chords.m[i] = 0;
  measure_chords(chords);
  const Shares& lost = chords.lost;
  for (std::size_t i = 0; i < chords.size; ++i)
    add_share(patch, chords.triangle[i], chords.ball[i], chords.sign[i], -lost.cones[i],
              -lost.angle[i], -lost.area[i], -lost.second[i], sums);
  chords.size = 0;
}

HWY_NOINLINE void take_corners(const SurfacePatch& patch, Corners& corners, ProbeSums& sums) {
  const std::size_t end = fill_up(corners);
  for (std::size_t i = corners.size; i < end; ++i) corners.x[i] = corners.y[i] = 0;
  measure_corners(patch, corners);
  const Shares& kept = corners.kept;
  for (std::size_t i = 0; i < corners.size; ++i)
    add_share(patch, static_cast<std::size_t>(corners.triangle[i]), corners.ball[i],
              corners.sign[i], kept.cones[i], kept.angle[i], kept.area[i], kept.second[i], sums);
  corners.size = 0;
}

/// Sorts a ball that comes near a triangle: it misses it, its disc lies within, edges cut the disc
/// from side to side, or it contains a corner.
HWY_INLINE void sort_disc(const SurfacePatch& patch, std::size_t t, std::size_t b, double height,
                          double x, double y, double r, Chords& chords, Corners& corners,
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
  const double h = std::abs(height), sign = height > 0 ? 1 : -1;
  if (found.has_corner) {
    const std::size_t i = corners.size++;
    corners.h[i] = h, corners.r[i] = r;
    corners.x[i] = x, corners.y[i] = y;
    corners.triangle[i] = static_cast<std::int64_t>(t);
    corners.ball[i] = static_cast<std::uint32_t>(b);
    corners.sign[i] = sign;
    if (corners.size == kAtOnce) take_corners(patch, corners, sums);
    return;
  }
  // No corner within: the disc is whole, but for the segments that are cut off; where the foot is
  // outside and no edge cuts, there is nothing.
  if (found.through == 0 && found.is_outside) return;
  const auto all = disc.whole();
  add_share(patch, t, b, 1, all.cones, all.angle, all.area, all.second, sums);
  for (int k = 0; k < 3; ++k) {
    if ((found.through >> k & 1) == 0) continue;
    const std::size_t i = chords.size++;
    chords.h[i] = h, chords.r[i] = r, chords.m[i] = disc.distance(k);
    chords.ball[i] = static_cast<std::uint32_t>(b);
    chords.triangle[i] = static_cast<std::uint32_t>(t);
    chords.sign[i] = sign;
    if (chords.size == kAtOnce) take_chords(patch, chords, sums);
  }
}

void add_patch_to(const SurfacePatch& patch, std::uint32_t triangles, const ProbeBalls& balls,
                  std::uint32_t chosen, ProbeSums& sums) {
  Chords chords;
  Corners corners;
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
