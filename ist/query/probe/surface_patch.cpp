#include "query/probe/surface_patch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/probe/surface_patch.cpp"
#include <hwy/foreach_target.h>

#include "query/probe/feet-inl.h"
#include "query/probe/sides.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

std::uint32_t near_of(const SurfacePatch& patch, const double (&centre)[3], double radius) {
  return feet_of<false>(patch, centre, radius, nullptr, nullptr, nullptr);
}

std::uint32_t odd_ways_of(const SurfacePatch& patch, std::uint32_t triangles,
                          const double (&start)[3], const ProbeBalls& balls, std::uint32_t wanted) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d);
  double way[3];  // from the start to the balls' origin
  for (int k = 0; k < 3; ++k) way[k] = balls.origin[k] - start[k];
  std::uint32_t odd = 0;
  for (; triangles != 0; triangles &= triangles - 1) {
    const std::size_t t = hwy::Num0BitsBelowLS1Bit_Nonzero32(triangles);
    double p[3][3];
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) p[c][k] = patch.corner[c][k][t] - start[k];
    const double nx = patch.n[0][t], ny = patch.n[1][t], nz = patch.n[2][t];
    const double h0 = -((p[0][0] * nx + p[0][1] * ny) + p[0][2] * nz);       // of the start
    const double height = h0 + ((way[0] * nx + way[1] * ny) + way[2] * nz);  // of the origin
    std::uint32_t above = 0;
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
      const V h = hn::Set(d, height) + ((hn::Load(d, balls.x + lane) * hn::Set(d, nx) +
                                         hn::Load(d, balls.y + lane) * hn::Set(d, ny)) +
                                        hn::Load(d, balls.z + lane) * hn::Set(d, nz));
      above |= mask_bits(d, h > zero) << lane;
    }
    const std::uint32_t across = (h0 > 0 ? ~above : above) & wanted;
    if (across == 0) continue;
    // Planes through the start and an edge: those of two triangles that share it are opposite,
    // digit for digit. A way in the plane is taken for one that ends a little further along x,
    // less along y, least along z; that is one way for all triangles, even around a corner.
    std::uint32_t all = 0xffff, none = 0xffff;
    for (int c = 0; c < 3; ++c) {
      const double(&a)[3] = p[c];
      const double(&b)[3] = p[(c + 1) % 3];
      double normal[3];
      cross(a, b, normal);
      std::uint32_t left = 0;
      if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0) {
        // The start is in line with the edge: it is moved likewise, by still less.
        for (std::size_t i = 0; i < kWidth; ++i) {
          const double to[3] = {balls.x[i] + way[0], balls.y[i] + way[1], balls.z[i] + way[2]};
          left |= passes_left_in_line(to, a, b) ? 1u << i : 0u;
        }
        all &= left;
        none &= ~left;
        if (((all | none) & across) == 0) break;
        continue;
      }
      const bool tie = first_is_positive(normal);
      const V plane[3] = {hn::Set(d, normal[0]), hn::Set(d, normal[1]), hn::Set(d, normal[2])};
      for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
        const V x = hn::Load(d, balls.x + lane) + hn::Set(d, way[0]);
        const V y = hn::Load(d, balls.y + lane) + hn::Set(d, way[1]);
        const V z = hn::Load(d, balls.z + lane) + hn::Set(d, way[2]);
        const V side = (x * plane[0] + y * plane[1]) + z * plane[2];
        left |= mask_bits(d, tie ? side >= zero : side > zero) << lane;
      }
      all &= left;
      none &= ~left;
      if (((all | none) & across) == 0) break;
    }
    odd ^= (all | none) & across;
  }
  return odd;
}

std::uint32_t balls_near_of(const SurfacePatch& patch, std::uint32_t triangles,
                            const ProbeBalls& balls) {
  std::uint32_t near = 0;
  for (; triangles != 0; triangles &= triangles - 1)
    near |= feet_near<false>(patch, hwy::Num0BitsBelowLS1Bit_Nonzero32(triangles), balls, nullptr,
                             nullptr, nullptr);
  return near;
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

std::uint32_t balls_within_of(const ProbeBalls& balls, const double (&point)[3], double distance) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const V px = hn::Set(d, point[0] - balls.origin[0]);
  const V py = hn::Set(d, point[1] - balls.origin[1]);
  const V pz = hn::Set(d, point[2] - balls.origin[2]);
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const V x = hn::Load(d, balls.x + lane) - px;
    const V y = hn::Load(d, balls.y + lane) - py;
    const V z = hn::Load(d, balls.z + lane) - pz;
    const V reach = hn::Load(d, balls.r + lane) + hn::Set(d, distance);
    near |= mask_bits(d, ((x * x + y * y) + z * z) <= reach * reach) << lane;
  }
  return near;
}

void make_patch_of(const TriangleCorners& corners, SurfacePatch& patch) {
  const LaneTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const V zero = hn::Zero(d);
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    V e[3], f[3];
    const auto take = [&](int k, const double(&of)[3][kWidth]) {
      const V a = hn::Load(d, of[0] + lane);
      const V b = hn::Load(d, of[1] + lane);
      const V c = hn::Load(d, of[2] + lane);
      e[k] = b - a;
      f[k] = c - a;
      hn::Store(a, d, patch.corner[0][k] + lane);
      hn::Store(b, d, patch.corner[1][k] + lane);
      hn::Store(c, d, patch.corner[2][k] + lane);
    };
    take(0, corners.x), take(1, corners.y), take(2, corners.z);
    const V cross[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                        e[0] * f[1] - e[1] * f[0]};
    const V area = hn::Sqrt((cross[0] * cross[0] + cross[1] * cross[1]) + cross[2] * cross[2]);
    const V base = hn::Sqrt((e[0] * e[0] + e[1] * e[1]) + e[2] * e[2]);
    const auto flat = hn::Not(area > zero);
    const V one = hn::Set(d, 1.0);
    const V per_area = one / hn::IfThenElse(flat, one, area);
    const V per_base = one / hn::IfThenElse(flat, one, base);
    V u[3], n[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = e[k] * per_base;
      n[k] = cross[k] * per_area;
      hn::Store(u[k], d, patch.u[k] + lane);
      hn::Store(n[k], d, patch.n[k] + lane);
    }
    for (int k = 0; k < 3; ++k) {
      const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      hn::Store(n[k1] * u[k2] - n[k2] * u[k1], d, patch.v[k] + lane);
    }
    const V apex_x = (f[0] * u[0] + f[1] * u[1]) + f[2] * u[2];
    const V apex_y = area * per_base;
    hn::Store(hn::Set(d, 1.0), d, patch.edge_x[0] + lane);
    hn::Store(zero, d, patch.edge_y[0] + lane);
    hn::Store(base, d, patch.length[0] + lane);
    const auto set_edge = [&](int k, V x, V y) {
      const V length = hn::Sqrt(x * x + y * y);
      const V per_length = one / hn::IfThenElse(flat, one, length);
      hn::Store(length, d, patch.length[k] + lane);
      hn::Store(x * per_length, d, patch.edge_x[k] + lane);
      hn::Store(y * per_length, d, patch.edge_y[k] + lane);
    };
    set_edge(1, apex_x - base, apex_y);
    set_edge(2, zero - apex_x, zero - apex_y);
    const V never = hn::Set(d, -1e300);
    hn::Store(hn::Min(zero, apex_x), d, patch.left + lane);
    hn::Store(hn::IfThenElse(flat, never, hn::Max(base, apex_x)), d, patch.right + lane);
    hn::Store(hn::IfThenElse(flat, never, apex_y), d, patch.top + lane);
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(make_patch_of);
HWY_EXPORT(near_of);
HWY_EXPORT(odd_ways_of);
HWY_EXPORT(balls_near_of);
HWY_EXPORT(balls_within_of);
HWY_EXPORT(place_probes_of);

std::uint32_t balls_within(const ProbeBalls& balls, const double (&point)[3],
                           double distance) noexcept {
  return HWY_DYNAMIC_DISPATCH(balls_within_of)(balls, point, distance);
}

std::uint32_t balls_near(const SurfacePatch& patch, std::uint32_t triangles,
                         const ProbeBalls& balls) noexcept {
  return HWY_DYNAMIC_DISPATCH(balls_near_of)(patch, triangles, balls);
}

void place_probes(const SphereTree& probes, int level, std::uint32_t block, const Similarity& map,
                  ProbeBalls& balls) noexcept {
  HWY_DYNAMIC_DISPATCH(place_probes_of)(probes, level, block, map, balls);
}

std::uint32_t triangles_near(const SurfacePatch& patch, const double (&centre)[3],
                             double radius) noexcept {
  return HWY_DYNAMIC_DISPATCH(near_of)(patch, centre, radius);
}

std::uint32_t odd_ways(const SurfacePatch& patch, std::uint32_t triangles, const double (&start)[3],
                       const ProbeBalls& balls, std::uint32_t wanted) noexcept {
  return HWY_DYNAMIC_DISPATCH(odd_ways_of)(patch, triangles, start, balls, wanted);
}

void make_patch(const TriangleCorners& corners, SurfacePatch& patch) noexcept {
  HWY_DYNAMIC_DISPATCH(make_patch_of)(corners, patch);
}

void make_patch(const SurfaceBlock& block, SurfacePatch& patch) noexcept {
  TriangleCorners corners;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      const std::size_t v = block.corner[k][lane];
      corners.x[k][lane] = static_cast<double>(block.x[v]);
      corners.y[k][lane] = static_cast<double>(block.y[v]);
      corners.z[k][lane] = static_cast<double>(block.z[v]);
    }
  }
  make_patch(corners, patch);
}

}  // namespace ist
#endif
