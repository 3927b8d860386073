#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "bake/surface/hull.h"
#include "bake/surface/hull_cuts.h"
#include "mesh/exact_closest_point.h"
#include "support/test_meshes.h"

// Convex hulls that are cut where triangles end, to show that they lie near a surface.

namespace ist {
namespace {

using HullPoint = Hull::Point;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double number(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  HullPoint point(double size) {
    return {number(-size, size), number(-size, size), number(-size, size)};
  }
  HullPoint point_of(const Hull& hull) {
    HullPoint x = {};
    double all = 0;
    for (const HullPoint& corner : hull.corners()) {
      const double weight = -std::log(number(1e-12, 1));
      all += weight;
      for (std::size_t k = 0; k < 3; ++k) x[k] += weight * corner[k];
    }
    for (double& v : x) v /= all;
    return x;
  }

 private:
  std::mt19937_64 engine_;
};

double dot(const HullPoint& a, const HullPoint& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// How far a hull reaches along a direction.
double reach(const Hull& hull, const HullPoint& direction) {
  double most = -HUGE_VAL;
  for (const HullPoint& corner : hull.corners()) most = std::max(most, dot(corner, direction));
  return most;
}

Hull::Plane plane_at(const HullPoint& point, const HullPoint& normal) {
  Hull::Plane plane;
  const double length = std::sqrt(dot(normal, normal));
  for (std::size_t k = 0; k < 3; ++k) plane.normal[k] = normal[k] / length;
  const double axis[3] = {0.36, 0.48, 0.8};
  cross3(plane.normal, axis, plane.u);
  cross3(plane.normal, plane.u, plane.v);
  plane.offset = dot3(plane.normal, point.data());
  return plane;
}

TEST(Hull, PartsHoldTheWholeAndNoMore) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<HullPoint> corners(3 + static_cast<std::size_t>(trial % 4));
    for (HullPoint& corner : corners) corner = random.point(1);
    const bool is_flat = trial % 3 == 0;
    if (is_flat)
      for (HullPoint& corner : corners) corner[2] = 0;
    const Hull whole(corners);
    std::vector<Hull> parts = {whole};
    for (int cut = 0; cut < 3; ++cut) {
      const Hull::Plane plane = plane_at(random.point_of(whole), random.point(1));
      std::vector<Hull> next;
      for (Hull part : parts) {
        Hull above;
        const Hull before = part;
        if (!part.cut(plane, above)) {  // too many corners: it stays
          EXPECT_TRUE(std::ranges::equal(part.corners(), before.corners()));
          next.push_back(part);
          continue;
        }
        for (const HullPoint& corner : part.corners())
          EXPECT_LE(dot3(plane.normal, corner.data()), plane.offset + 1e-12);
        for (const HullPoint& corner : above.corners())
          EXPECT_GE(dot3(plane.normal, corner.data()), plane.offset - 1e-12);
        for (const Hull& one : {part, above})
          if (!one.is_empty()) next.push_back(one);
      }
      parts = next;
    }
    // Every point of the whole is in the part on its side of all planes: seen by reaches.
    for (int i = 0; i < 20; ++i) {
      const HullPoint direction = random.point(1);
      double most = -HUGE_VAL;
      for (const Hull& part : parts) most = std::max(most, reach(part, direction));
      EXPECT_NEAR(most, reach(whole, direction), 1e-12);
    }
  }
}

// Two parts of one cut: what each reaches is what the points of the whole on its side reach.
TEST(Hull, ACutLeavesNothingOut) {
  Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    std::array<HullPoint, 6> corners;
    for (HullPoint& corner : corners) corner = random.point(1);
    const Hull whole(corners);
    // Every other plane goes through a corner.
    const HullPoint at = trial % 2 == 0 ? corners[0] : random.point_of(whole);
    const Hull::Plane plane = plane_at(at, random.point(1));
    Hull below = whole, above;
    ASSERT_TRUE(below.cut(plane, above));
    const HullPoint direction = random.point(1);
    for (int i = 0; i < 50; ++i) {
      const HullPoint x = random.point_of(whole);
      const Hull& part = dot3(plane.normal, x.data()) > plane.offset ? above : below;
      EXPECT_LE(dot(x, direction), reach(part, direction) + 1e-12);
    }
  }
}

TEST(HullCuts, WhatIsShownIsSo) {
  const MeshSolid solid(close_mesh(testing::icosphere_mesh(3), "ball"));
  const MeshView& surface = solid.view();
  const HullCuts cuts(surface);
  const auto distance = [&](const HullPoint& p) {
    return exact_closest_point(surface, {p[0], p[1], p[2]}, 1e3).distance;
  };
  Random random(3);
  int shown = 0, near = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    // A triangle that moves along the surface, and from it.
    const HullPoint at = random.point(1);
    const double size = std::exp2(random.number(-7, -1)),
                 height = std::exp2(random.number(-14, -5));
    std::array<HullPoint, 6> corners;
    for (HullPoint& corner : corners) {
      const HullPoint off = random.point(size);
      for (std::size_t k = 0; k < 3; ++k) corner[k] = at[k] + off[k];
      const ClosestPoint on = exact_closest_point(surface, {corner[0], corner[1], corner[2]}, 1e3);
      const HullPoint lift = random.point(height);
      for (std::size_t k = 0; k < 3; ++k) corner[k] = on.point[static_cast<int>(k)] + lift[k];
    }
    const Hull hull(corners);
    double most = 0;
    for (const HullPoint& corner : corners) most = std::max(most, distance(corner));
    for (int i = 0; i < 100; ++i) most = std::max(most, distance(random.point_of(hull)));
    for (const double ratio : {0.7, 0.97, 1.3}) {
      const double limit = ratio * most;
      const bool is_within = cuts.is_within(hull, {}, limit, {corners[0], distance(corners[0])});
      if (ratio < 1) {
        EXPECT_FALSE(is_within) << ratio << " " << trial;
        continue;
      }
      near += 1;
      shown += is_within ? 1 : 0;
      if (!is_within) continue;
      for (int i = 0; i < 300; ++i) EXPECT_LE(distance(random.point_of(hull)), limit + 1e-12);
    }
  }
  std::printf("%d of %d shown\n", shown, near);
  EXPECT_GT(shown, near / 2);
}

}  // namespace
}  // namespace ist
