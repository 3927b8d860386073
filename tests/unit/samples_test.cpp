#include "mesh/samples/samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <ist/solid.h>
#include <ist/types.h>

#include "mesh/hierarchy/winding.h"

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

/// Largest depth at which a corner of the nut, turned and moved along z, lies in the bolt, or one
/// of the bolt in the nut; negative if they keep a distance.
double deepest_corner(double turns, double along) {
  const ist::TriangleMesh bolt = ist::make_sample("bolt"), nut = ist::make_sample("nut");
  const auto bolt_solid = ist::make_solid(ist::close_mesh(bolt, "bolt"));
  const auto nut_solid = ist::make_solid(ist::close_mesh(nut, "nut"));
  const Eigen::Matrix3d r =
      Eigen::AngleAxisd(2 * std::numbers::pi * turns, Eigen::Vector3d::UnitZ()).matrix();
  const Eigen::Vector3d t(0, 0, along);
  double deepest = -1;
  for (const Eigen::Vector3d& v : nut.vertices)
    deepest = std::max(deepest, -bolt_solid->signed_distance(r * v + t));
  for (const Eigen::Vector3d& v : bolt.vertices)
    deepest = std::max(deepest, -nut_solid->signed_distance(r.transpose() * (v - t)));
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

/// The parts of a line along x at (y, z) that lie in a solid, [u].
std::vector<std::pair<double, double>> inside_parts(const ist::MeshSolid& solid, double y,
                                                    double z) {
  const ist::UnitFrame& frame = solid.frame();
  const Eigen::Vector3d unit = frame.to_unit({0, y, z});
  std::vector<ist::Crossing> crossings;
  line_crossings(solid.view(), unit.y(), unit.z(), crossings);
  std::vector<std::pair<double, double>> parts;
  for (std::size_t i = 0; i + 1 < crossings.size(); i += 2)
    parts.emplace_back(frame.from_unit({crossings[i].x, 0, 0}).x(),
                       frame.from_unit({crossings[i + 1].x, 0, 0}).x());
  return parts;
}

/// ./dev demo says what the two profiles overlap by: integrated here from the meshes themselves.
TEST(Samples, TheNutHalfAPitchOffOverlapsByTheProfilesClosedForm) {
  // π · height · mean over the pitch of (bolt radius² − nut radius²)₊, in closed form.
  constexpr double kClosedForm = 52.78;
  const ist::MeshSolid bolt(ist::close_mesh(ist::make_sample("bolt"), "bolt"));
  const ist::MeshSolid nut(ist::close_mesh(ist::make_sample("nut"), "nut"));
  constexpr double kStep = 0.04, kNutHeight = 9, kReach = 5.2;
  double volume = 0;
  for (double y = -kReach + 0.37 * kStep; y < kReach; y += kStep)
    for (double z = -4 + 0.61 * kStep; z < 4; z += kStep)
      for (const auto& [b0, b1] : inside_parts(bolt, y, z + kNutHeight))
        for (const auto& [n0, n1] : inside_parts(nut, y, z))
          volume += std::max(0.0, std::min(b1, n1) - std::max(b0, n0)) * kStep * kStep;
  EXPECT_NEAR(volume, kClosedForm, 0.005 * kClosedForm);  // 60 flat sides a turn
}

}  // namespace
