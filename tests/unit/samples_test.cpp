#include "mesh/samples/samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <ist/error.h>
#include <ist/solid.h>

namespace {

using ist::ClosedMesh;
using ist::Sample;

class EverySample : public ::testing::TestWithParam<Sample> {};

TEST_P(EverySample, IsClosedOutwardAndFreeOfSelfIntersections) {
  const ClosedMesh closed = ist::close_mesh(GetParam().make(), GetParam().name);
  EXPECT_TRUE(closed.report.closed);
  EXPECT_FALSE(closed.report.repaired);
  EXPECT_EQ(closed.report.boundary_edges, 0u);
  EXPECT_EQ(closed.report.nonmanifold_edges, 0u);
  EXPECT_EQ(closed.report.inconsistent_edges, 0u);
  EXPECT_EQ(closed.report.flipped_components, 0u);
  EXPECT_EQ(closed.report.degenerate_triangles, 0u);
  EXPECT_EQ(closed.report.coincident_triangles, 0u);
  ASSERT_TRUE(closed.report.self_intersections_counted);
  EXPECT_EQ(closed.report.self_intersections, 0u);
  EXPECT_GT(closed.report.volume, 0);
}

INSTANTIATE_TEST_SUITE_P(Samples, EverySample, ::testing::ValuesIn(ist::samples()),
                         [](const auto& instance) { return std::string(instance.param.name); });

double volume_of(const char* name) {
  return ist::close_mesh(ist::make_sample(name), name).report.volume;
}

TEST(Samples, HaveTheVolumeOfTheirShape) {
  constexpr double pi = std::numbers::pi;
  EXPECT_EQ(volume_of("cube"), 1);
  EXPECT_EQ(volume_of("slab"), 3);
  // Inscribed in the curved shape: a little less, never more.
  const auto expect_inscribed = [](const char* name, double exact) {
    EXPECT_LT(volume_of(name), exact) << name;
    EXPECT_GT(volume_of(name), 0.99 * exact) << name;
  };
  expect_inscribed("sphere", 4 * pi / 3);
  expect_inscribed("torus", 2 * pi * pi * 0.35 * 0.35);
  expect_inscribed("cylinder", 2 * pi);
  expect_inscribed("capsule", pi * 0.25 * (4.0 / 3 * 0.5 + 2));
  EXPECT_NEAR(volume_of("hollow_sphere"), 4 * pi / 3 * (1 - 0.729), 0.01);
}

TEST(Samples, AnUnknownNameListsTheNamesThereAre) {
  try {
    ist::make_sample("screw");
    FAIL();
  } catch (const ist::Error& error) {
    EXPECT_NE(std::string(error.what()).find("bolt, nut"), std::string::npos) << error.what();
  }
}

/// Largest depth at which a corner of the nut, turned and moved along z, lies in the bolt, and the
/// other way round; negative where they keep a distance.
double deepest_corner(double turns, double along) {
  const ist::TriangleMesh bolt = ist::make_sample("bolt"), nut = ist::make_sample("nut");
  const auto bolt_solid = ist::make_solid(ist::close_mesh(bolt, "bolt"));
  const auto nut_solid = ist::make_solid(ist::close_mesh(nut, "nut"));
  const Eigen::Matrix3d r =
      Eigen::AngleAxisd(2 * std::numbers::pi * turns, Eigen::Vector3d::UnitZ()).matrix();
  const Eigen::Vector3d t(0, 0, along);
  double deepest = -1;
  for (const Eigen::Vector3d& v : nut.vertices)
    deepest = std::max(deepest, bolt_solid->signed_distance(r * v + t));
  for (const Eigen::Vector3d& v : bolt.vertices)
    deepest = std::max(deepest, nut_solid->signed_distance(r.transpose() * (v - t)));
  return deepest;
}

TEST(Samples, TheNutTurnsAlongTheBoltsThread) {
  for (const double turns : {0.0, 0.125, 0.4031, 1.77})
    EXPECT_LT(deepest_corner(turns, 6 + turns * ist::kThreadPitch), -0.05) << turns;
}

TEST(Samples, TheNutCollidesHalfAPitchOff) {
  EXPECT_GT(deepest_corner(0, 6 + ist::kThreadPitch / 2), 0.2);
  EXPECT_GT(deepest_corner(0.5, 6), 0.2);                            // turned without moving
  EXPECT_GT(deepest_corner(-0.25, 6 + ist::kThreadPitch / 4), 0.2);  // the other hand
}

}  // namespace
