#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "support/reference_sum.h"
#include "support/surface_queries.h"

// Gaps between fields and trees.

namespace ist {
namespace {

using namespace testing;

/// Distance of a point from a field in its own frame, positive outside.
double outside_of(const Shape& field, const Vector3d& x) {
  if (const auto* f = std::get_if<HalfSpaceShape>(&field)) return f->normal.dot(x) - f->offset;
  if (const auto* f = std::get_if<BallShape>(&field)) return x.norm() - f->radius;
  if (const auto* f = std::get_if<BoxShape>(&field)) {
    const Vector3d q = x.cwiseAbs() - f->half_extents;
    return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
  }
  if (const auto* f = std::get_if<CapsuleShape>(&field)) {
    const double z = std::clamp(x.z(), -f->half_height, f->half_height);
    return (x - Vector3d(0, 0, z)).norm() - f->radius;
  }
  const auto& f = std::get<CylinderShape>(field);
  const double side = x.head<2>().norm() - f.radius, end = std::abs(x.z()) - f.half_height;
  return std::hypot(std::max(side, 0.0), std::max(end, 0.0)) + std::min(0.0, std::max(side, end));
}

TEST(FieldQuery, SeparationIsTheNearestSpheres) {
  Workspace workspace;
  std::mt19937_64 random(29);
  for (const auto& [name, field] : fields()) {
    const std::string kind = name;
    if (kind == "terrain" || kind == "grid" || kind == "function") continue;
    const bool mesh = kind == "mesh";
    const double scale = 1.3;
    int apart = 0;
    for (int i = 0; i < 30; ++i) {
      const PlacedShape a{field, random_pose(random, 0.3), scale};
      const PlacedAsset b{cube().view(), random_pose(random, 0.1 + 0.08 * i), 0.5};
      const Separation got = separation(a, b, {}, workspace);
      ASSERT_EQ(got.status, QueryStatus::ok) << name;
      const Quaterniond q = rotation(a.pose).conjugate();
      const auto local = [&](const Vector3d& x) -> Vector3d {
        return q * (x - position(a.pose)) / scale;
      };
      double gap = std::numeric_limits<double>::infinity();
      if (mesh) {
        // The torus as its segments: by another query, against a ball field of its own.
        const Separation trees =
            separation(PlacedAsset{torus().view(), a.pose, scale}, b, {}, workspace);
        EXPECT_LE(got.distance_min, trees.distance_max + 1e-9);
        EXPECT_GE(got.distance_max, trees.distance_min - 1e-9);
      } else {
        for (const WorldSphere& s : world_spheres(b, Measure::inner))
          gap = std::min(gap, scale * outside_of(field, local(s.centre)) - s.r);
        EXPECT_NEAR(got.distance, std::max(0.0, gap), 1e-9) << name;
        EXPECT_GE(got.distance_max, std::max(0.0, gap) - 1e-12) << name;
        // The cube's own corners tell the solids' distance from above, faces aside.
        double corners = std::numeric_limits<double>::infinity();
        for (int c = 0; c < 8; ++c) {
          const Vector3d x((c & 1) - 0.5, (c >> 1 & 1) - 0.5, (c >> 2) - 0.5);
          corners = std::min(corners, scale * outside_of(field, local(rotation(b.pose) * (0.5 * x) +
                                                                      position(b.pose))));
        }
        EXPECT_LE(got.distance_min, std::max(0.0, corners) + 1e-9) << name;
        if (kind == "half-space") {
          EXPECT_GE(got.distance_max, std::max(0.0, corners) - 1e-9);
        }
      }
      EXPECT_LE(got.distance_min, got.distance);
      if (!(got.distance > 0)) {
        EXPECT_EQ(got.normal, Vector3d::Zero()) << name;
        EXPECT_EQ(got.point_a, Vector3d::Zero()) << name;
        EXPECT_EQ(got.distance_max, 0) << name;
        continue;
      }
      ++apart;
      EXPECT_NEAR((got.point_b - got.point_a).norm(), got.distance, 1e-9) << name;
      EXPECT_NEAR(got.normal.dot(got.point_b - got.point_a), got.distance, 1e-9) << name;
      if (!mesh) {
        EXPECT_NEAR(scale * outside_of(field, local(got.point_a)), 0, 1e-9) << name;
      }
      double on = std::numeric_limits<double>::infinity();
      for (const WorldSphere& s : world_spheres(b, Measure::inner))
        on = std::min(on, std::abs((got.point_b - s.centre).norm() - s.r));
      EXPECT_LE(on, 1e-9) << name;
    }
    EXPECT_GT(apart, 3) << name;
  }
}

// Far over a large terrain whose heights are known to lie within bounds, a query does not visit all
// of it.
TEST(FieldQuery, SeparationFromALargeTerrain) {
  Workspace workspace;
  std::vector<float> heights(1000 * 1000);
  for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = static_cast<float>(i % 7) * 0.001f;
  HeightFieldShape terrain;
  terrain.heights = heights.data();
  terrain.columns = terrain.rows = 1000;
  terrain.spacing[0] = terrain.spacing[1] = 0.01;
  terrain.lowest = 0, terrain.highest = 0.0061;
  for (const double z : {1.0, 3.0, 50.0}) {
    const PlacedAsset b{cube().view(), pose_of(Quaterniond::Identity(), {5, 5, z}), 1};
    const Separation got = separation(PlacedShape{terrain, {}, 1}, b, {}, workspace);
    double lowest = std::numeric_limits<double>::infinity();
    for (const WorldSphere& s : world_spheres(b, Measure::inner))
      lowest = std::min(lowest, s.centre.z() - s.r);
    // A ridge of triangles runs under every sphere, to within the grid's own spacing.
    EXPECT_GE(got.distance, lowest - 0.0061);
    EXPECT_LE(got.distance, lowest);
  }
}

}  // namespace
}  // namespace ist
