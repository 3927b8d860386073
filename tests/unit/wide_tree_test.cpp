#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <list>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "base/team.h"
#include "mesh/geometry/closest_point.h"
#include "mesh/hierarchy/wide_searches.h"
#include "mesh/hierarchy/winding.h"
#include "mesh/mesh_solid.h"
#include "support/host_wide_tree.h"
#include "support/test_meshes.h"

// The wide tree's queries against the CPU's own hierarchy: the same bits, everywhere.

namespace {

using namespace ist::testing;
using Eigen::Vector3d;
using ist::kNoTriangle;
using ist::MeshSolid;
using ist::SerialTeam;

constexpr double kFar = std::numeric_limits<double>::infinity();

/// Long thin triangles fanned about a line, closed by a second fan.
ist::TriangleMesh needles_mesh(std::uint32_t count) {
  ist::TriangleMesh mesh;
  mesh.vertices = {{-1, 0, 0}, {1, 1e-7, 2e-7}};
  for (std::uint32_t i = 0; i < count; ++i) {
    const double a = 6.283185307179586 * i / count;
    mesh.vertices.emplace_back(0.3 * std::sin(37.0 * i), 1e-4 * std::cos(a), 1e-4 * std::sin(a));
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t p = 2 + i, q = 2 + (i + 1) % count;
    mesh.triangles.push_back({0, q, p});
    mesh.triangles.push_back({1, p, q});
  }
  return mesh;
}

ist::TriangleMesh potato(std::uint64_t seed, int subdivisions) {
  ist::TriangleMesh mesh = icosphere_mesh(subdivisions);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> radius(0.7, 1.3);
  for (auto& v : mesh.vertices) v *= radius(random);
  return mesh;
}

struct TreeCase {
  std::string name;
  ist::TriangleMesh mesh;
};

std::vector<TreeCase> tree_cases() {
  ist::TriangleMesh far = potato(3, 3);
  for (auto& v : far.vertices) v = 1e-3 * v + Vector3d(7e3, -2e3, 1e4);
  return {{"cube", cube_mesh()},
          {"cubes", overlapping_cubes_mesh()},
          {"twice the same cube", joined(cube_mesh(), cube_mesh())},
          {"cube less itself", joined(cube_mesh(), inverted(cube_mesh()))},
          {"sphere", icosphere_mesh(2)},
          {"many equally far", icosphere_mesh(4)},
          {"potato", potato(1, 4)},
          {"far off", far},
          {"torus", torus_mesh(1, 0.2, 200, 90)},
          {"needles", needles_mesh(200)}};
}

/// Random points, lattice points, and corners, edges and faces of the mesh itself, nudged or not.
std::vector<Vector3d> points_about(const ist::MeshView& mesh, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> coordinate(-1.2, 1.2);
  std::vector<Vector3d> points = {Vector3d::Zero(), {3, 4, -5}, {1e6, 0, 0}, {0.25, -1e3, 2}};
  for (int i = 0; i < 300; ++i)
    points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  for (int i = 0; i < 125; ++i)
    points.push_back(Vector3d(i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2) / 4);
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t* t = mesh.triangles + 3 * (random() % mesh.triangle_count);
    const auto corner = [&](int k) { return Vector3d(mesh.vertices + 3 * std::size_t{t[k]}); };
    Vector3d p = corner(0);
    if (i % 3 == 1) p = (p + corner(1)) / 2;
    if (i % 3 == 2) p = (p + corner(1) + corner(2)) / 3;
    points.push_back(p);
    const double nudge = std::ldexp(1, -10 * (1 + i % 5));
    points.push_back(p +
                     nudge * Vector3d(coordinate(random), coordinate(random), coordinate(random)));
  }
  return points;
}

class WideTree : public ::testing::TestWithParam<std::size_t> {
 protected:
  const TreeCase case_ = tree_cases()[GetParam()];
  const MeshSolid solid_{closed(case_.mesh, case_.name)};
  const HostWideTree host_{solid_.view()};
  const ist::WideTree& tree_ = host_.tree();
  const std::vector<Vector3d> points_ = points_about(solid_.view(), 11 + GetParam());
};

TEST_P(WideTree, HoldsEveryTriangleOnceInBoxesThatHoldIt) {
  const ist::MeshView& mesh = solid_.view();
  std::set<std::uint32_t> seen;
  for (std::uint32_t slot = 0; slot < tree_.block_count * ist::kWideWidth; ++slot) {
    const std::uint32_t t = triangle_in(tree_, slot);
    if (t == kNoTriangle) continue;
    EXPECT_TRUE(seen.insert(t).second);
    const ist::Corners corners = corners_in(tree_, slot);
    for (std::size_t k = 0; k < 3; ++k) {
      const double* corner = corners.p[k];
      ASSERT_EQ(corner, mesh.vertices + 3 * std::size_t{mesh.triangles[3 * t + k]});
      std::uint32_t place = tree_.first_leaf + slot / ist::kWideWidth;
      while (place > 0) {
        const ist::WideNode& parent = tree_.nodes[(place - 1) / ist::kWideWidth];
        const std::uint32_t child = (place - 1) % ist::kWideWidth;
        for (int c = 0; c < 3; ++c) {
          ASSERT_LE(double(parent.lower[c][child]), corner[c]);
          ASSERT_GE(double(parent.upper[c][child]), corner[c]);
        }
        place = (place - 1) / ist::kWideWidth;
      }
    }
  }
  EXPECT_EQ(seen.size(), mesh.triangle_count);
}

TEST_P(WideTree, OrientedBoxesHoldTheirTriangles) {
  for (std::uint32_t slot = 0; slot < tree_.block_count * ist::kWideWidth; ++slot) {
    const std::uint32_t block = slot / ist::kWideWidth, child = block % ist::kWideWidth;
    if (triangle_in(tree_, slot) == kNoTriangle) continue;
    const ist::WideOriented& boxes = tree_.oriented[block / ist::kWideWidth];
    float axis[3][3];
    for (int k = 0; k < 3; ++k) {
      axis[0][k] = boxes.n[k][child];
      axis[1][k] = boxes.u[k][child];
    }
    ist::cross3(axis[0], axis[1], axis[2]);
    for (int i = 0; i < 3; ++i) {
      const Vector3d a(axis[i][0], axis[i][1], axis[i][2]);
      const Vector3d b(axis[(i + 1) % 3][0], axis[(i + 1) % 3][1], axis[(i + 1) % 3][2]);
      ASSERT_NEAR(a.norm(), 1, 2e-7);
      ASSERT_NEAR(a.dot(b), 0, 2e-7);
      for (const double* corner : corners_in(tree_, slot).p)
        ASSERT_LE(std::abs(a.dot(Vector3d(corner)) - boxes.middle[i][child]),
                  double(boxes.half[i][child]));
    }
  }
}

TEST_P(WideTree, NearestIsTheCpusBitForBit) {
  for (const Vector3d& x : points_) {
    const float p[3] = {float(x.x()), float(x.y()), float(x.z())};
    const ist::NearestTriangle expected = nearest_triangle(solid_.view(), p);
    for (const float factor : {0.0f, 0.25f, 1.0f, 2.25f}) {
      const float limit2 = factor > 0 ? factor * expected.distance2 : 1e30f;
      const ist::NearestTriangle limited = nearest_triangle(solid_.view(), p, limit2);
      const ist::WideNearest found = nearest(SerialTeam(), tree_, p, limit2);
      ASSERT_EQ(found.distance2, limited.distance2) << x.transpose();
      ASSERT_EQ(found.triangle, limited.triangle) << x.transpose();
      ASSERT_EQ(found.slot == ist::kNoSlot, found.triangle == kNoTriangle);
      if (found.slot == ist::kNoSlot) continue;
      ASSERT_EQ(triangle_in(tree_, found.slot), found.triangle);
    }
  }
}

TEST_P(WideTree, TrianglesWithinAreTheCpus) {
  constexpr int kCapacity = 40;
  std::uint32_t slots[kCapacity];
  int overflown = 0;
  for (const Vector3d& x : points_) {
    const float p[3] = {float(x.x()), float(x.y()), float(x.z())};
    const float nearest2 = nearest_triangle(solid_.view(), p).distance2;
    for (const float radius2 : {0.0f, nearest2, 1.5f * nearest2 + 1e-6f, 1e-2f}) {
      std::set<std::uint32_t> expected, found;
      for_triangles_near(solid_.view(), p, radius2, [&](const ist::NearTriangle& near) {
        expected.insert(near.triangle);
        return radius2;
      });
      const int count = triangles_within(SerialTeam(), tree_, p, radius2, slots, kCapacity);
      if (expected.size() > kCapacity) {
        ASSERT_GT(count, kCapacity);
        ++overflown;
        continue;
      }
      ASSERT_EQ(std::size_t(count), expected.size());
      for (int i = 0; i < count; ++i) found.insert(triangle_in(tree_, slots[i]));
      ASSERT_EQ(found, expected);
    }
  }
  EXPECT_TRUE(overflown > 0 || case_.name != "needles");
}

TEST_P(WideTree, ExactDistanceIsTheCpusBitForBit) {
  for (const Vector3d& x : points_) {
    const double distance = solid_.closest_point(x).distance;
    for (const double limit :
         {kFar, 0.5 * distance, distance, distance * (1 + 1e-15), 2 * distance}) {
      const ist::ClosestPoint expected = solid_.closest_point(x, limit);
      const ist::WideExact found = exact_nearest(SerialTeam(), tree_, x.data(), limit);
      ASSERT_EQ(found.distance, expected.distance) << x.transpose();
      ASSERT_EQ(found.triangle, expected.triangle) << x.transpose();
      if (found.slot == ist::kNoSlot) continue;
      Vector3d point;
      exact_closest_in(corners_in(tree_, found.slot), x.data(), point.data());
      ASSERT_EQ(point, expected.point);
    }
  }
}

TEST_P(WideTree, WindingNumbersAreTheCpus) {
  for (const Vector3d& x : points_)
    ASSERT_EQ(winding_number(SerialTeam(), tree_, x.data()), solid_.winding_number(x))
        << x.transpose();
}

TEST_P(WideTree, LineCrossingsAreTheCpus) {
  constexpr int kCapacity = 64;
  double where[kCapacity];
  int sign[kCapacity];
  std::vector<ist::Crossing> expected;
  for (const Vector3d& x : points_) {
    line_crossings(solid_.view(), x.y(), x.z(), expected);
    const int count = line_crossings(SerialTeam(), tree_, x.y(), x.z(), where, sign, kCapacity);
    ASSERT_EQ(std::size_t(count), expected.size());
    if (count > kCapacity) continue;
    std::vector<ist::Crossing> found;
    for (int i = 0; i < count; ++i) found.push_back({where[i], sign[i]});
    std::sort(found.begin(), found.end(), [](const ist::Crossing& a, const ist::Crossing& b) {
      return a.x != b.x ? a.x < b.x : a.sign > b.sign;
    });
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(found[i].x, expected[i].x);
      ASSERT_EQ(found[i].sign, expected[i].sign);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, WideTree, ::testing::Range(std::size_t{0}, tree_cases().size()),
                         [](const auto& info) {
                           std::string name = tree_cases()[info.param].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
