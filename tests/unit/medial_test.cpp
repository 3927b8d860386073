#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/types.h>

#include <cmath>

#include "mesh/mesh_solid.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

MedialSettings on_cpu(unsigned resolution) {
  MedialSettings settings;
  settings.resolution = resolution;
  settings.device = Device::cpu;
  return settings;
}

/// The centre line of the tube.
TEST(MedialNodes, LieOnTheAxisOfATorus) {
  const auto solid = make_solid(testing::closed(testing::torus_mesh(1, 0.3, 96, 48), "torus"));
  const std::vector<MedialNode> nodes = medial_nodes(*solid, on_cpu(24));
  EXPECT_GT(nodes.size(), 40u);
  for (const MedialNode& n : nodes) {
    const double off = std::hypot(std::hypot(n.point.x(), n.point.y()) - 1, n.point.z());
    EXPECT_LT(off, 0.02) << n.point.transpose();
    EXPECT_NEAR(n.radius, 0.3, 0.01);
    EXPECT_GE(n.contacts, 2);
  }
}

/// Halfway between the large faces of a plate, or where an edge's bisecting planes begin.
TEST(MedialNodes, LieOnTheMiddlePlaneOfAPlate) {
  const auto solid = make_solid(testing::closed(
      testing::box_mesh(Eigen::Vector3d(10, 0, 0), Eigen::Vector3d(12, 1.7, 0.2)), "plate"));
  const std::vector<MedialNode> nodes = medial_nodes(*solid, on_cpu(32));
  EXPECT_GT(nodes.size(), 300u);
  std::size_t central = 0;
  for (const MedialNode& n : nodes) {
    EXPECT_LT(n.radius, 0.1001);
    central += std::abs(n.point.z() - 0.1) < 0.003 ? 1 : 0;
  }
  EXPECT_GT(central, nodes.size() * 9 / 10);
}

TEST(MedialNodes, AreRefusedWhereTheyCannotBeFound) {
  const auto ball = make_ball({0, 0, 0}, 1);
  EXPECT_THROW(medial_nodes(*ball), Error);
  const auto cube = make_solid(testing::closed(testing::cube_mesh(), "cube"));
  EXPECT_THROW(medial_nodes(*cube, on_cpu(5000)), Error);
}

}  // namespace
}  // namespace ist
