#include <gtest/gtest.h>
#include <ist/error.h>
#include <ist/packing.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "mesh/mesh_solid.h"

namespace ist {
namespace {

/// A box as a closed mesh of twelve triangles.
ClosedMesh box_mesh(const Eigen::Vector3d& lo, const Eigen::Vector3d& hi) {
  ClosedMesh box;
  box.name = "box";
  for (int i = 0; i < 8; ++i)
    box.mesh.vertices.emplace_back((i & 1) != 0 ? hi.x() : lo.x(), (i & 2) != 0 ? hi.y() : lo.y(),
                                   (i & 4) != 0 ? hi.z() : lo.z());
  box.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return box;
}

/// Every pair and every sphere, in double, in the unit frame (DESIGN 3.2).
void expect_certified(const SpherePacking& packing, const Solid& solid) {
  const double scale = packing.frame.scale();
  for (std::size_t i = 0; i < packing.spheres.size(); ++i) {
    const Sphere& a = packing.spheres[i];
    const Eigen::Vector3d centre(a.x, a.y, a.z);
    const double distance = solid.signed_distance(packing.frame.from_unit(centre)) / scale;
    ASSERT_GT(a.r, 0);
    ASSERT_LE(double{a.r} + 1e-13, distance) << "sphere " << i;
    for (std::size_t j = 0; j < i; ++j) {
      const Sphere& b = packing.spheres[j];
      const double gap =
          (centre - Eigen::Vector3d(b.x, b.y, b.z)).norm() - double{a.r} - double{b.r};
      ASSERT_GE(gap, 1e-12) << "spheres " << j << " and " << i;
    }
  }
}

bool same_bytes(const SpherePacking& a, const SpherePacking& b) {
  return a.spheres.size() == b.spheres.size() &&
         std::memcmp(a.spheres.data(), b.spheres.data(), a.spheres.size() * sizeof(Sphere)) == 0;
}

TEST(Packing, BoxIsPackedCertifiedAndToTheCount) {
  const auto solid = make_solid(box_mesh({-1, -0.5, -0.7}, {1.5, 0.5, 0.7}));
  PackingSettings settings;
  for (const std::size_t count : {1u, 2u, 17u, 300u}) {
    settings.max_spheres = count;
    const SpherePacking packing = pack(*solid, settings);
    EXPECT_EQ(packing.spheres.size(), count);
    EXPECT_EQ(packing.stop, StopReason::sphere_count);
    expect_certified(packing, *solid);
  }
}

TEST(Packing, ThreadCountDoesNotChangeABit) {
  const auto solid = make_solid(box_mesh({0, 0, 0}, {1, 1, 1}));
  PackingSettings settings;
  settings.max_spheres = 500;
  settings.threads = 1;
  const SpherePacking one = pack(*solid, settings);
  const oneapi::tbb::global_control allow_five(oneapi::tbb::global_control::max_allowed_parallelism,
                                               5);
  for (const unsigned threads : {1u, 2u, 5u}) {
    settings.threads = threads;
    EXPECT_TRUE(same_bytes(one, pack(*solid, settings))) << threads << " threads";
  }
}

TEST(Packing, SettingsOutOfRangeAreRefused) {
  const auto solid = make_solid(box_mesh({0, 0, 0}, {1, 1, 1}));
  PackingSettings bad;
  bad.target_coverage = 1.5;
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.epsilon = 1;
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.min_radius = -1;
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.max_spheres = 0;
  EXPECT_THROW(pack(*solid, bad), Error);
}

}  // namespace
}  // namespace ist
