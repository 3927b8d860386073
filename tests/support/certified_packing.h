#pragma once

#include <gtest/gtest.h>
#include <ist/bake.h>

#include <cstring>

#include "mesh/mesh_solid.h"

namespace ist::testing {

/// Every pair and every sphere, by brute force in double, in the unit frame (docs/design.md 3.2).
inline void expect_certified(const SpherePacking& packing, const MeshSolid& solid) {
  for (std::size_t i = 0; i < packing.spheres.size(); ++i) {
    const Sphere& a = packing.spheres[i];
    const Eigen::Vector3d centre(a.x, a.y, a.z);
    ASSERT_GT(a.r, 0);
    ASSERT_TRUE(solid.inside(centre)) << "sphere " << i;
    ASSERT_LE(double{a.r} + 1e-12, solid.closest_point(centre).distance) << "sphere " << i;
    for (std::size_t j = 0; j < i; ++j) {
      const Sphere& b = packing.spheres[j];
      const double gap =
          (centre - Eigen::Vector3d(b.x, b.y, b.z)).norm() - double{a.r} - double{b.r};
      ASSERT_GE(gap, 1e-12) << "spheres " << j << " and " << i;
    }
  }
}

inline bool same_bytes(const SpherePacking& a, const SpherePacking& b) {
  return a.spheres.size() == b.spheres.size() && a.stop == b.stop &&
         std::memcmp(a.spheres.data(), b.spheres.data(), a.spheres.size() * sizeof(Sphere)) == 0;
}

}  // namespace ist::testing
