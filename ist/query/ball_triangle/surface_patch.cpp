#include "query/ball_triangle/surface_patch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/ball_triangle/surface_patch.cpp"
#include <hwy/foreach_target.h>

#include "query/ball_triangle/disc_lanes-inl.h"
#include "query/ball_triangle/feet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

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

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

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

}  // namespace ist
#endif
