#include "query/ball_triangle/patch_sums.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "query/asset/shared_constants.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/ball_triangle/patch_sums.cpp"
#include <hwy/foreach_target.h>

#include "query/ball_triangle/angle-inl.h"
#include "query/ball_triangle/feet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

using DiscTag = hn::CappedTag<double, 8>;
using Disc = hn::Vec<DiscTag>;

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

/// Discs that hold a corner.
struct alignas(64) Corners {
  double h[kRoom], r[kRoom];
  double x[kRoom], y[kRoom];  ///< the foot in the triangle's plane
  std::int64_t triangle[kRoom];
  std::uint32_t ball[kRoom];
  double sign[kRoom];
  Shares kept;  ///< within the triangle
  std::size_t size = 0;
};

struct ShareVectors {
  Disc cones, angle, area, second;
};

HWY_INLINE void store(const ShareVectors& from, DiscTag d, std::size_t i, Shares& to) {
  hn::Store(from.cones, d, to.cones + i);
  hn::Store(from.angle, d, to.angle + i);
  hn::Store(from.area, d, to.area + i);
  hn::Store(from.second, d, to.second + i);
}

/// The disc in which a plane cuts a ball, and what a sector of one radian of it has.
struct DiscShape {
  HWY_INLINE DiscShape(DiscTag d, Disc height, Disc radius)
      : h(height), h2(height * height), r(radius), r3(radius * (radius * radius)) {
    const Disc cap = r - h;
    rho2 = cap * (r + h);
    // (r − h)² (2r + h) / 6: no difference of like numbers.
    cones = hn::Set(d, 1.0 / 6) * (cap * cap) * (r + (r + h));
    angle = cap / r;
    area = hn::Set(d, 0.5) * rho2;
    second = hn::Set(d, 0.25) * (rho2 * rho2);
  }
  Disc h, h2, r, r3, rho2, cones, angle, area, second;
};

/// A triangle of the foot and two points at distance m from it, `low` and `high` along the edge.
HWY_INLINE void add_triangle(DiscTag d, const DiscShape& disc, Disc omega, Disc m, Disc low,
                             Disc high, ShareVectors& sums) {
  const Disc cross = m * (high - low);
  const Disc area = hn::Set(d, 0.5) * cross;
  const Disc spread = hn::Set(d, 1.0 / 12) * cross *
                      ((low * low + low * high) + (high * high + hn::Set(d, 3.0) * (m * m)));
  sums.cones = sums.cones + hn::Set(d, 1.0 / 3) * (disc.r3 * omega - disc.h * area);
  sums.angle = sums.angle + omega;
  sums.area = sums.area + area;
  sums.second = sums.second + (disc.rho2 * area - spread);
}

HWY_INLINE void add_sector(const DiscShape& disc, Disc phi, ShareVectors& sums) {
  sums.cones = sums.cones + phi * disc.cones;
  sums.angle = sums.angle + phi * disc.angle;
  sums.area = sums.area + phi * disc.area;
  sums.second = sums.second + phi * disc.second;
}

/// The segments beyond the chords: the sector over a chord without its triangle.
HWY_INLINE void measure_chords(Chords& chords) {
  const DiscTag d;
  const Disc zero = hn::Zero(d), two = hn::Set(d, 2.0);
  for (std::size_t i = 0; i < chords.size; i += hn::Lanes(d)) {
    const DiscShape disc(d, hn::Load(d, chords.h + i), hn::Load(d, chords.r + i));
    const Disc m = hn::Load(d, chords.m + i);
    const Disc half = hn::Sqrt(hn::Max(disc.rho2 - m * m, zero));
    const Disc phi = two * angle_of(d, m, half);
    const Disc omega = two * angle_of(d, (disc.h2 + m * m) + disc.h * disc.r, m * half);
    ShareVectors sums{zero, zero, zero, zero};
    add_triangle(d, disc, zero - omega, zero - m, zero - half, half, sums);
    add_sector(disc, phi, sums);
    store(sums, d, i, chords.lost);
  }
}

/// Adds the part between the foot and an edge that goes from t1 to t2 at signed distance m from it,
/// positive if the foot is within.
HWY_INLINE void add_edge(DiscTag d, const DiscShape& disc, Disc m, Disc t1, Disc t2,
                         ShareVectors& sums) {
  const Disc zero = hn::Zero(d);
  const Disc m2 = m * m;
  const Disc half = hn::Sqrt(hn::Max(disc.rho2 - m2, zero));
  const Disc low = hn::Min(hn::Max(zero - half, t1), t2);
  const Disc high = hn::Min(hn::Max(half, t1), t2);
  // Two sectors as one angle.
  const Disc x1 = m2 + t1 * low, y1 = m * (low - t1);
  const Disc x2 = m2 + high * t2, y2 = m * (t2 - high);
  add_sector(disc, angle_of(d, x1 * x2 - y1 * y2, x1 * y2 + y1 * x2), sums);
  const Disc flat = m2 + disc.h2;
  const Disc a = hn::Sqrt(low * low + flat), b = hn::Sqrt(high * high + flat);
  const Disc omega = hn::Set(d, 2.0) * angle_of(d, (a * b + disc.h * (a + b)) + (low * high + flat),
                                                m * (high - low));
  add_triangle(d, disc, omega, m, low, high, sums);
}

HWY_INLINE void measure_corners(const SurfacePatch& patch, Corners& corners) {
  const DiscTag d;
  const hn::RebindToSigned<DiscTag> di;
  const Disc zero = hn::Zero(d);
  for (std::size_t i = 0; i < corners.size; i += hn::Lanes(d)) {
    const auto at = hn::Load(di, corners.triangle + i);
    const auto of = [&](const double* values) { return hn::GatherIndex(d, values, at); };
    const DiscShape disc(d, hn::Load(d, corners.h + i), hn::Load(d, corners.r + i));
    const Disc x = hn::Load(d, corners.x + i), y = hn::Load(d, corners.y + i);
    ShareVectors sums{zero, zero, zero, zero};
    const Disc base = of(patch.length[0]);
    add_edge(d, disc, y, zero - x, base - x, sums);
    const auto other = [&](int k, Disc px) {
      const Disc ex = of(patch.edge_x[k]), ey = of(patch.edge_y[k]);
      const Disc t = px * ex - y * ey;
      add_edge(d, disc, px * ey + y * ex, t, t + of(patch.length[k]), sums);
    };
    other(1, base - x);
    // The third edge ends in the first corner.
    const Disc ex = of(patch.edge_x[2]), ey = of(patch.edge_y[2]);
    const Disc t = zero - (x * ex + y * ey);
    add_edge(d, disc, y * ex - x * ey, t - of(patch.length[2]), t, sums);
    store(sums, d, i, corners.kept);
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

/// Lanes beyond the last must hold numbers.
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
/// from side to side, or it holds a corner.
HWY_INLINE void sort_disc(const SurfacePatch& patch, std::size_t t, std::size_t b, double height,
                          double x, double y, double r, Chords& chords, Corners& corners,
                          ProbeSums& sums) {
  const double h = std::abs(height);
  const double rho2 = (r - h) * (r + h);
  const double base = patch.length[0][t];
  const double ex1 = patch.edge_x[1][t], ey1 = patch.edge_y[1][t];
  const double ex2 = patch.edge_x[2][t], ey2 = patch.edge_y[2][t];
  const double px = base - x;
  // Distances of the edges, and where they begin and end.
  const double m[3] = {y, px * ey1 + y * ex1, y * ex2 - x * ey2};
  const double t1 = px * ex1 - y * ey1, t2 = -(x * ex2 + y * ey2);
  const double begin[3] = {-x, t1, t2 - patch.length[2][t]};
  const double end[3] = {px, t1 + patch.length[1][t], t2};
  if (std::min(std::min(m[0] * m[0], m[1] * m[1]), m[2] * m[2]) + h * h < kOnEdge2 * (r * r))
    sums.on_edge |= 1u << b;
  unsigned cut = 0, outside = 0;
  bool corner = false, away = false;
  for (unsigned k = 0; k < 3; ++k) {
    const double m2 = m[k] * m[k];
    outside |= m[k] < 0 ? 1u : 0u;
    if (m2 >= rho2) {
      away |= m[k] < 0;
      continue;
    }
    const double half2 = rho2 - m2;
    const bool past_begin = begin[k] >= 0 || begin[k] * begin[k] < half2;
    const bool before_end = end[k] <= 0 || end[k] * end[k] < half2;
    if (!past_begin && !before_end) {
      cut |= 1u << k;
      continue;
    }
    // A corner in the disc, or the whole edge beside the chord's middle: on one side of the disc,
    // or not at it at all.
    corner |= begin[k] * begin[k] < half2 || end[k] * end[k] < half2;
  }
  if (away) return;
  sums.meet(b);
  ++sums.pairs;
  const double sign = height > 0 ? 1 : -1;
  if (corner) {
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
  if (cut == 0 && outside != 0) return;
  const double cap = r - h, turn = 2 * std::numbers::pi;
  add_share(patch, t, b, sign, turn * ((1.0 / 6) * (cap * cap) * (r + (r + h))), turn * (cap / r),
            turn * (0.5 * rho2), turn * (0.25 * (rho2 * rho2)), sums);
  for (unsigned k = 0; k < 3; ++k) {
    if ((cut >> k & 1) == 0) continue;
    const std::size_t i = chords.size++;
    chords.h[i] = h, chords.r[i] = r, chords.m[i] = m[k];
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
  moved.reach += 0x1p-11 * most;
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
