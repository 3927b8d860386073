// Distances of solids of unlike sizes, far apart for their size, that touch, or that fit into each
// other: none is expensive.

#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <random>
#include <vector>

#include "support/exact_pair.h"
#include "support/random_assets.h"
#include "support/random_mates.h"
#include "support/surface_queries.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

/// A screw beside a hull, a part beside a hall, two at opposite ends of a yard: no query takes
/// more than five times the work of the dearest of solids of one size, side by side.
TEST(UnlikeSeparation, IsNoDearer) {
  const std::vector<Asset> solids = [] {
    std::vector<Asset> made;
    made.push_back(testing::surface(testing::icosphere_mesh(4)));
    made.push_back(testing::surface(testing::torus_mesh(0.7, 0.3, 80, 40)));
    made.push_back(testing::surface(testing::box_mesh({-1, -0.7, -0.01}, {1, 0.7, 0.01})));
    return made;
  }();
  std::mt19937_64 random(7);
  Workspace workspace;
  const auto dearest = [&](double scale, double far) {
    std::uint32_t most = 0;
    for (const Asset& a : solids)
      for (const Asset& b : solids)
        for (int i = 0; i < 6; ++i) {
          Pose pose_a, pose_b;
          if (i % 2 == 0) {
            pose_a = testing::random_pose(random, 0);
            pose_b = testing::random_pose(random, 0);
          }
          const testing::Vector3d direction =
              i % 3 == 0 ? testing::Vector3d::UnitZ() : testing::random_direction(random);
          for (int k = 0; k < 3; ++k) pose_b.t[k] = far * (1 + scale) * direction[k];
          const PlacedAsset placed_a{a.view(), pose_a, 1}, placed_b{b.view(), pose_b, scale};
          for (const bool swapped : {false, true}) {
            const Separation found = swapped ? separation(placed_b, placed_a, {}, workspace)
                                             : separation(placed_a, placed_b, {}, workspace);
            EXPECT_EQ(found.status, QueryStatus::ok);
            most = std::max(most, found.node_visits + found.sphere_pairs / 8);
          }
        }
    return most;
  };
  const std::uint32_t alike = std::max(dearest(1, 1.2), dearest(1, 2.5));
  for (const double scale : {1.0, 0.1, 1e-2, 1e-3, 1e-5, 1e-8})
    for (const double far : {1.1, 2.5, 1e2, 1e4, 1e7})
      EXPECT_LT(dearest(scale, far), 5 * alike) << scale << ' ' << far;
}

/// No exact sign is needed where two triangles share a point.
TEST(UnlikeSeparation, FacesOnEachOtherCostWhatFacesNextToEachOtherDo) {
  const Asset cube = testing::surface(testing::cube_mesh(), "cube");
  Workspace workspace;
  const Pose turned = {{0.7, 0.3, -0.5, std::sqrt(0.17)}, {}};
  for (const Pose& of_a : {Pose{}, turned})
    for (const testing::Vector3d& along :
         {testing::Vector3d(1, 0, 0), testing::Vector3d(0, 0, -1)}) {
      const auto seconds = [&](double gap) {
        Pose of_b = of_a;
        const testing::Vector3d to = testing::rotation(of_a) * ((1 + gap) * along);
        for (int k = 0; k < 3; ++k) of_b.t[k] = to[k];
        double least = 1e9;
        for (int i = 0; i < 9; ++i) {
          const std::clock_t begin = std::clock();
          for (int n = 0; n < 50; ++n) {
            const Separation found =
                separation({cube.view(), of_a, 1}, {cube.view(), of_b, 1}, {}, workspace);
            EXPECT_NEAR(found.distance, gap, 1e-14);
          }
          least = std::min(least, double(std::clock() - begin));
        }
        return least;
      };
      EXPECT_LT(seconds(0), 2 * seconds(1e-9)) << along.transpose();
    }
}

/// A tube in a tube is as near all round. Planes exclude most pairs of triangles.
TEST(UnlikeSeparation, PartsThatFitAreNotMeasuredAllRound) {
  constexpr int kFacets = 200;
  const auto tube = [&](double radius, double bore) {
    const auto of = testing::Extrusion::tube(kFacets, radius, bore, 0, 1);
    return testing::surface(of.mesh(), "tube");
  };
  const Asset around = tube(1, 0.8), within = tube(0.79, 0.7);
  Workspace workspace;
  for (const double z : {0.5, 0.501}) {
    const PlacedAsset a = {around.view(), {}, 1}, b = {within.view(), {{1, 0, 0, 0}, {0, 0, z}}, 1};
    for (const Separation& found :
         {separation(a, b, {}, workspace), separation(b, a, {}, workspace)}) {
      EXPECT_NEAR(found.distance, 0.01 * std::cos(std::numbers::pi / kFacets), 1e-14);
      EXPECT_LT(found.sphere_pairs, 8 * kFacets) << z;
    }
  }
}

}  // namespace
}  // namespace ist
