#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <list>
#include <numbers>
#include <random>
#include <vector>

#include "mesh/geometry/exact_sign.h"
#include "mesh/hierarchy/line_lattice.h"
#include "mesh/hierarchy/winding.h"
#include "support/test_meshes.h"

namespace {

using namespace ist::testing;
using Eigen::Vector3d;
using ist::Crossing;
using ist::MeshSolid;

/// Winding number by the sum of solid angles (Van Oosterom and Strackee): no rays, no predicates.
double solid_angle_winding(const ist::MeshView& mesh, const Vector3d& p) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    Vector3d c[3];
    for (std::size_t i = 0; i < 3; ++i)
      c[i] = Vector3d(mesh.vertices + 3 * std::size_t{mesh.triangles[3 * t + i]}) - p;
    const double a = c[0].norm(), b = c[1].norm(), d = c[2].norm();
    sum += std::atan2(c[0].dot(c[1].cross(c[2])),
                      a * b * d + c[0].dot(c[1]) * d + c[1].dot(c[2]) * a + c[2].dot(c[0]) * b);
  }
  return sum / (2 * std::numbers::pi);
}

/// An icosphere dented and blown at random: star-shaped, closed.
ist::TriangleMesh potato(std::uint64_t seed) {
  ist::TriangleMesh mesh = icosphere_mesh(2);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> radius(0.5, 1.5);
  for (auto& v : mesh.vertices) v *= radius(random);
  return mesh;
}

std::list<MeshSolid> random_solids() {
  std::list<MeshSolid> solids;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    ist::TriangleMesh other = potato(seed + 100);
    for (auto& v : other.vertices) v += Vector3d(0.7, 0.1, -0.2);
    solids.emplace_back(closed(potato(seed), "potato"));
    solids.emplace_back(closed(joined(potato(seed), other), "two potatoes"));
    solids.emplace_back(closed(joined(potato(seed), inverted(other)), "one minus the other"));
  }
  // The hierarchy has oriented boxes over needles alone.
  ist::TriangleMesh other = needle_tube(90, 0.2);
  for (Vector3d& v : other.vertices) v = Vector3d(v.y(), 0.6 * v.z(), v.x());
  solids.emplace_back(closed(joined(needle_tube(120, 0.5), other), "two tubes"));
  EXPECT_NE(solids.back().view().oriented, nullptr);
  EXPECT_EQ(solids.front().view().oriented, nullptr);
  return solids;
}

TEST(Winding, AgreesWithSolidAngles) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-1.1, 1.1);
  int most = 0, least = 0;
  for (const MeshSolid& solid : random_solids()) {
    for (int i = 0; i < 400; ++i) {
      const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
      const int winding = solid.winding_number(p);
      ASSERT_NEAR(winding, solid_angle_winding(solid.view(), p), 1e-6);
      most = std::max(most, winding);
      least = std::min(least, winding);
    }
  }
  EXPECT_EQ(most, 2);
  EXPECT_EQ(least, -1);
}

/// Rays through lattice points run through faces, edges, diagonals and corners of the boxes.
TEST(Winding, LatticePointsOfBoxes) {
  const MeshSolid solid(
      closed(joined(overlapping_cubes_mesh(),
                    inverted(box_mesh(Vector3d::Constant(0.25), Vector3d::Constant(0.75)))),
             "boxes"));
  const auto inside = [](const Vector3d& p, double lower, double upper) {
    return p.minCoeff() > lower && p.maxCoeff() < upper ? 1 : 0;
  };
  const auto on_surface = [](const Vector3d& p, double lower, double upper) {
    return p.minCoeff() >= lower && p.maxCoeff() <= upper &&
           (p.minCoeff() == lower || p.maxCoeff() == upper);
  };
  int checked = 0;
  for (int i = -6; i <= 10; ++i) {
    for (int j = -6; j <= 10; ++j) {
      for (int k = -6; k <= 10; ++k) {
        const Vector3d p = Vector3d(i, j, k) / 8;
        if (on_surface(p, -0.5, 0.5) || on_surface(p, 0, 1) || on_surface(p, 0.25, 0.75)) continue;
        const int expected = inside(p, -0.5, 0.5) + inside(p, 0, 1) - inside(p, 0.25, 0.75);
        ASSERT_EQ(solid.winding_number(solid.frame().to_unit(p)), expected) << p.transpose();
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 3000);
}

/// 1e-12 off a triangle the side is known, however the triangle lies to the ray.
TEST(Winding, IsRightCloseToTheSurface) {
  ist::TriangleMesh turned = cube_mesh();
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.1, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.2, Vector3d::UnitX()))
          .toRotationMatrix();
  for (auto& v : turned.vertices) v = turn * v;
  ist::TriangleMesh sheared = cube_mesh();  // side faces all but parallel to the ray
  for (auto& v : sheared.vertices) v.y() += 1e-9 * v.x();
  const ist::TriangleMesh meshes[] = {cube_mesh(), turned, sheared, potato(7),
                                      torus_mesh(1, 0.3, 50, 25)};
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> weight(0.05, 1);
  for (const ist::TriangleMesh& mesh : meshes) {
    const MeshSolid solid(closed(mesh, "mesh"));
    const ist::MeshView& view = solid.view();
    for (std::size_t i = 0; i < 3000; ++i) {
      const std::size_t t = i % view.triangle_count;
      const auto corner = [&](std::size_t k) {
        return Vector3d(view.vertices + 3 * std::size_t{view.triangles[3 * t + k]});
      };
      const Vector3d a = corner(0), b = corner(1), c = corner(2);
      const double u = weight(random), v = weight(random), w = weight(random);
      const Vector3d p = (u * a + v * b + w * c) / (u + v + w);
      const Vector3d normal = (b - a).cross(c - a).normalized();
      ASSERT_EQ(solid.winding_number(p - 1e-12 * normal), 1) << i;
      ASSERT_EQ(solid.winding_number(p + 1e-12 * normal), 0) << i;
    }
  }
}

TEST(LineCrossings, SumToZeroAndAgreeWithTheWindingNumber) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<Crossing> crossings;
  for (const MeshSolid& solid : random_solids()) {
    for (int i = 0; i < 300; ++i) {
      double y = coordinate(random), z = coordinate(random);
      if (i % 3 == 1) {  // straight through a corner
        const auto& view = solid.view();
        const double* corner =
            view.vertices + 3 * (static_cast<std::size_t>(i) % view.vertex_count);
        y = corner[1];
        z = corner[2];
      }
      line_crossings(solid.view(), y, z, crossings);
      int winding = 0;
      for (std::size_t k = 0; k < crossings.size(); ++k) {
        winding += crossings[k].sign;
        if (k + 1 == crossings.size()) continue;
        ASSERT_LE(crossings[k].x, crossings[k + 1].x);
        if (crossings[k + 1].x - crossings[k].x < 1e-9) continue;
        const double middle = (crossings[k].x + crossings[k + 1].x) / 2;
        ASSERT_EQ(solid.winding_number({middle, y, z}), winding);
      }
      ASSERT_EQ(winding, 0);
    }
  }
}

TEST(LineCrossings, OfManyLinesAreThoseOfEach) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-1.2, 1.2);
  for (const MeshSolid& solid : random_solids()) {
    std::vector<std::array<double, 2>> lines(500);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const double* corner = solid.view().vertices + 3 * (i % solid.view().vertex_count);
      lines[i] = {coordinate(random), coordinate(random)};
      if (i % 3 == 1) lines[i] = {corner[1], corner[2]};
    }
    const auto found = line_crossings(solid.arrays(), lines);
    std::vector<Crossing> expected;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      line_crossings(solid.view(), lines[i][0], lines[i][1], expected);
      ASSERT_TRUE(std::ranges::equal(found[i], expected, [](const Crossing& a, const Crossing& b) {
        return a.x == b.x && a.sign == b.sign;
      }));
    }
  }
}

TEST(LineCrossings, IntegrateToTheVolume) {
  const MeshSolid solid(closed(torus_mesh(2, 0.7, 60, 30), "torus"));
  constexpr int kLines = 400;
  std::vector<Crossing> crossings;
  double sum = 0;
  for (int i = 0; i < kLines; ++i) {
    for (int j = 0; j < kLines; ++j) {
      line_crossings(solid.view(), (2 * i + 1.0) / kLines - 1, (2 * j + 1.0) / kLines - 1,
                     crossings);
      for (const Crossing& c : crossings) sum -= c.sign * c.x;
    }
  }
  EXPECT_NEAR(sum * 4 / (kLines * kLines), solid.unit_volume(), 1e-3 * solid.unit_volume());
}

// More crossings than are found at once: their parts join without a gap.
TEST(LatticeCrossings, AllRowsOfManyLines) {
  ist::TriangleMesh tubes;
  for (int k = 0; k < 20; ++k) tubes = joined(tubes, torus_mesh(2, 0.7 - 0.01 * k, 60, 30));
  const MeshSolid solid(closed(tubes, "tubes"));
  ist::LineLattice lattice;
  lattice.y0 = -0.68;
  lattice.z0 = -0.18;
  lattice.ny = lattice.nz = 700;
  lattice.step_y = 1.36 / lattice.ny;
  lattice.step_z = 0.36 / lattice.nz;
  lattice.offset = 0.5;
  std::uint32_t next = 0, parts = 0;
  std::vector<Crossing> expected;
  ist::cross_lattice(solid.arrays(), lattice,
                     [&](const std::uint32_t row, const ist::LatticeCrossings& lines) {
                       EXPECT_EQ(row, next);
                       next += static_cast<std::uint32_t>(lines.size() / lattice.ny);
                       ++parts;
                       for (const std::size_t line : {std::size_t{500}, lines.size() - 500}) {
                         const std::uint32_t j = row + std::uint32_t(line / lattice.ny);
                         const std::uint32_t i = std::uint32_t(line % lattice.ny);
                         line_crossings(solid.view(), lattice.y(i, j), lattice.z(j), expected);
                         ASSERT_EQ(lines[line].size(), expected.size());
                         for (std::size_t k = 0; k < expected.size(); ++k)
                           EXPECT_EQ(lines[line][k].x, expected[k].x);
                       }
                     });
  EXPECT_EQ(next, lattice.nz);
  EXPECT_GT(parts, 1u);
}

/// Points on and beside the line through (12, 12) and (24, 24), a hair apart: against integers.
TEST(ExactSign, NearlyCollinearPoints) {
  const auto exact = [](const double p[2]) {  // (x − y) · 12 in units of 2^-53
    const auto x = static_cast<std::int64_t>(std::ldexp(p[0], 53));
    const auto y = static_cast<std::int64_t>(std::ldexp(p[1], 53));
    return (y > x) - (y < x);
  };
  const double a[2] = {12, 12}, b[2] = {24, 24};
  for (int i = 0; i < 128; ++i) {
    for (int j = 0; j < 128; ++j) {
      const double p[2] = {0.5 + std::ldexp(i, -53), 0.5 + std::ldexp(j, -53)};
      ASSERT_EQ(ist::orient2d_sign(a, b, p), exact(p));
      ASSERT_EQ(ist::orient2d_sign(b, a, p), -exact(p));
      // The same line lifted to a plane that contains z.
      const double a3[3] = {12, 12, 1}, b3[3] = {24, 24, 5}, c3[3] = {12, 12, 7};
      const double p3[3] = {p[0], p[1], 3};
      const int side = ist::orient3d_sign(a3, b3, c3, p3);
      ASSERT_EQ(std::abs(side), std::abs(exact(p)));
      ASSERT_EQ(ist::orient3d_sign(b3, a3, c3, p3), -side);
      ASSERT_EQ(ist::orient3d_sign(b3, c3, a3, p3), side);
    }
  }
}

}  // namespace
