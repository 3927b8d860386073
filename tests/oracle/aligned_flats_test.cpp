#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/shapes.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "support/test_meshes.h"

// Cubes face to face: what pushes sideways beyond the exact gradient of the overlap's volume.

namespace ist {
namespace {

using Eigen::Vector3d;

const Asset& cube() {
  static const Asset asset = [] {
    PackingSettings settings;
    settings.max_spheres = 4000;
    return bake(close_mesh(testing::cube_mesh(), "cube"), settings);
  }();
  return asset;
}

Pose turned(double x, double y, double z, double yaw) {
  return {{std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)}, {x, y, z}};
}

TEST(AlignedFlats, AFieldsFaceDoesNotPushSideways) {
  Workspace workspace;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const double depth : {0.0, 0.002, 0.01, 0.05}) {
    for (int i = 0; i < 20; ++i) {
      const double x = uniform(random), y = uniform(random), yaw = 3 * uniform(random);
      for (const Shape& field : {Shape(HalfSpaceShape{}), Shape(BoxShape{{3, 3, 0.25}})}) {
        const double top = std::holds_alternative<BoxShape>(field) ? 0.25 : 0;
        const Penetration p =
            penetration(PlacedShape{field, {}},
                        {cube().view(), turned(x, y, top + 0.5 - depth, yaw)}, {}, workspace);
        EXPECT_GT(p.force.z(), 0.3);
        EXPECT_LE(p.force.head<2>().norm(), 0.003 * p.force.z());
      }
    }
  }
}

// Faces that overlap in part are pushed apart by the exact gradient, depth times edge: what is
// beyond it is the spheres'. By the meshes there is nothing.
TEST(AlignedFlats, CubesOnCubesPushSidewaysAsTheExactGradientDoes) {
  Workspace workspace;
  const auto beyond = [&](const PenetrationSettings& settings, double depth) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    std::vector<double> shares;
    for (int i = 0; i < 100; ++i) {
      const double x = uniform(random), y = uniform(random);
      const Penetration p = penetration(
          {cube().view(), {}}, {cube().view(), turned(x, y, 1 - depth, 0)}, settings, workspace);
      const Eigen::Vector2d exact(std::copysign((1 - std::abs(y)) * depth, x),
                                  std::copysign((1 - std::abs(x)) * depth, y));
      const Vector3d push = p.force;
      shares.push_back((push.head<2>() - exact).norm() / push.z());
    }
    std::sort(shares.begin(), shares.end());
    return shares;
  };
  for (const double depth : {0.01, 0.02}) {
    const std::vector<double> meshes = beyond({.measure = Measure::exact}, depth);
    const std::vector<double> lenses = beyond({}, depth);
    std::printf("depth %g: by lenses median %.4f, p95 %.4f, worst %.4f\n", depth, lenses[50],
                lenses[95], lenses[99]);
    EXPECT_LE(meshes.back(), 1e-12);
    EXPECT_LE(lenses[95], 0.03);
  }
}

}  // namespace
}  // namespace ist
