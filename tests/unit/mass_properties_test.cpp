#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/mass_properties.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include <ist/asset_layout.h>
#include "mesh/mesh_solid.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::box_mesh;
using testing::closed;
using testing::joined;

/// Volume, first and second moments about the origin, in long double.
struct Reference {
  long double volume = 0;
  std::array<long double, 3> first = {};
  std::array<std::array<long double, 3>, 3> second = {};

  void add(const Reference& other, int sign) {
    volume += sign * other.volume;
    for (std::size_t i = 0; i < 3; ++i) {
      first[i] += sign * other.first[i];
      for (std::size_t j = 0; j < 3; ++j) second[i][j] += sign * other.second[i][j];
    }
  }
  Vector3d centre() const {
    Vector3d c;
    for (int i = 0; i < 3; ++i) c[i] = static_cast<double>(first[std::size_t(i)] / volume);
    return c;
  }
  Matrix3d inertia() const {
    Matrix3d m;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        long double value = 0;
        for (std::size_t k = 0; k < 3 && i == j; ++k)
          value += second[k][k] - first[k] * first[k] / volume;
        m(int(i), int(j)) =
            static_cast<double>(value - second[i][j] + first[i] * first[j] / volume);
      }
    return m;
  }
};

/// Another form of the divergence theorem, ∫ x² = ∮ x³/3 n_x and so on, over each triangle by
/// quadrature that is exact for cubic functions.
Reference by_quadrature(const TriangleMesh& mesh) {
  using Point = std::array<long double, 3>;
  Reference sum;
  for (const auto& t : mesh.triangles) {
    std::array<Point, 3> p;
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) p[c][k] = mesh.vertices[t[c]][int(k)];
    Point n;  // normal times area
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      n[k] =
          ((p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i])) /
          2;
    }
    for (int q = 0; q < 4; ++q) {
      const long double weight = q == 0 ? -27.0L / 48 : 25.0L / 48;
      Point x = {};
      for (std::size_t c = 0; c < 3; ++c) {
        const long double share = q == 0 ? 1.0L / 3 : int(c) == q - 1 ? 0.6L : 0.2L;
        for (std::size_t k = 0; k < 3; ++k) x[k] += share * p[c][k];
      }
      sum.volume += weight * x[0] * n[0];
      for (std::size_t i = 0; i < 3; ++i) {
        sum.first[i] += weight * x[i] * x[i] / 2 * n[i];
        for (std::size_t j = 0; j < 3; ++j)
          sum.second[i][j] += i == j ? weight * x[i] * x[i] * x[i] / 3 * n[i]
                                     : weight * x[i] * x[i] * x[j] / 2 * n[i];
      }
    }
  }
  return sum;
}

Reference of_box(const Vector3d& lower, const Vector3d& upper) {
  Reference box;
  box.volume = 1;
  for (int k = 0; k < 3; ++k) box.volume *= static_cast<long double>(upper[k]) - lower[k];
  for (std::size_t i = 0; i < 3; ++i) {
    const long double a = lower[int(i)], b = upper[int(i)];
    box.first[i] = box.volume * (a + b) / 2;
    for (std::size_t j = 0; j < 3; ++j) {
      const long double c = lower[int(j)], d = upper[int(j)];
      box.second[i][j] =
          box.volume * (i == j ? (a * a + a * b + b * b) / 3 : (a + b) * (c + d) / 4);
    }
  }
  return box;
}

Asset asset_of(const TriangleMesh& mesh, const std::string& name) {
  PackingSettings settings;
  settings.max_spheres = 20;
  settings.keep_mesh = false;
  return bake(close_mesh(mesh, name), settings);
}

void expect_within_errors(const MassProperties& found, const Reference& expected) {
  const double volume = static_cast<double>(expected.volume);
  EXPECT_LE(std::abs(found.volume - volume), found.volume_error);
  EXPECT_LE((found.centre_of_mass - expected.centre()).cwiseAbs().maxCoeff(),
            found.centre_of_mass_error);
  EXPECT_LE((found.inertia - expected.inertia()).cwiseAbs().maxCoeff(), found.inertia_error);
}

/// Relative to volume, size and the inertia's trace.
void expect_near(const MassProperties& found, const Reference& expected, double size,
                 double accuracy) {
  const double volume = static_cast<double>(expected.volume);
  EXPECT_NEAR(found.volume, volume, accuracy * volume);
  EXPECT_LE((found.centre_of_mass - expected.centre()).norm(), accuracy * size);
  EXPECT_LE((found.inertia - expected.inertia()).cwiseAbs().maxCoeff(),
            accuracy * expected.inertia().trace());
}

TEST(MassProperties, OfBoxesInClosedForm) {
  struct Case {
    Vector3d lower, upper;
  };
  for (const Case& c : {Case{{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}, Case{{5, -1, 0}, {6, 1, 1e-3}},
                        Case{{0.1, 0.2, -0.7}, {3.3, 0.4, 0.9}}}) {
    const MassProperties found =
        mass_properties(asset_of(box_mesh(c.lower, c.upper), "box").view());
    const Reference expected = of_box(c.lower, c.upper);
    expect_within_errors(found, expected);
    expect_near(found, expected, c.upper.norm(), 4e-16);
    EXPECT_LT(found.inertia_error, 1e-13 * found.inertia.trace());
  }
}

/// Rounding does not grow with the triangles, nor with cavities.
TEST(MassProperties, OfPolyhedraByAnotherFormula) {
  TriangleMesh off_centre = testing::torus_mesh(2, 0.5, 120, 60);
  const Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (Vector3d& v : off_centre.vertices) v = turn * v + Vector3d(0.3, -0.2, 0.9);
  const TriangleMesh shell = joined(testing::icosphere_mesh(5), [] {
    TriangleMesh inner = testing::icosphere_mesh(4);
    for (Vector3d& v : inner.vertices) v *= 0.99;
    return testing::inverted(inner);
  }());
  for (const TriangleMesh& mesh : {testing::icosphere_mesh(5), off_centre, shell}) {
    const MassProperties found = mass_properties(asset_of(mesh, "polyhedron").view());
    const Reference expected = by_quadrature(mesh);
    expect_within_errors(found, expected);
    expect_near(found, expected, 3, 5e-15);
    EXPECT_LT(found.inertia_error, 1e-12 * found.inertia.trace());
  }
  // And those are about the ball's and the torus'.
  const Reference ball = by_quadrature(testing::icosphere_mesh(5));
  const double pi = std::numbers::pi;
  EXPECT_NEAR(ball.inertia()(0, 0), 8 * pi / 15, 0.005);
  const Reference torus = by_quadrature(testing::torus_mesh(2, 0.5, 120, 60));
  EXPECT_NEAR(torus.inertia()(2, 2), 2 * pi * pi * 2 * 0.25 * (4 + 0.75 * 0.25), 0.3);
}

/// Every digit is kept far from the origin, and at any size.
TEST(MassProperties, OffsetsAndSizesDoNotMatter) {
  const Vector3d lower(-0.5, -0.25, 0), upper(0.75, 0.5, 0.0625);
  const MassProperties plain = mass_properties(asset_of(box_mesh(lower, upper), "box").view());
  for (const double size : {0x1p-30, 1.0, 0x1p30})
    for (const double offset : {0.0, 1e7}) {
      const Vector3d shift = offset * size * Vector3d(1, -0.5, 0.25);
      const Asset asset = asset_of(box_mesh(size * lower + shift, size * upper + shift), "box");
      const MassProperties found = mass_properties(asset.view());
      EXPECT_DOUBLE_EQ(found.volume, size * size * size * plain.volume);
      EXPECT_LE((found.inertia / std::pow(size, 5) - plain.inertia).cwiseAbs().maxCoeff(), 1e-17);
      const Vector3d expected = size * plain.centre_of_mass + shift;
      EXPECT_LE((found.centre_of_mass - expected).cwiseAbs().maxCoeff(),
                1e-16 * size + 1e-16 * expected.norm());
      const Bounds held = bounds(asset.view());
      EXPECT_EQ(held.lower, size * lower + shift);
      EXPECT_EQ(held.upper, size * upper + shift);
      EXPECT_GE(held.radius, (held.upper - held.centre).norm() * (1 - 1e-15));
      EXPECT_LE(held.radius, (upper - lower).norm() / 2 * size * (1 + 2e-8));
    }
}

/// Volume shared by shells counts once, as in the volume.
TEST(MassProperties, OfSolidsThatMeetThemselves) {
  const Vector3d zero = Vector3d::Zero(), one = Vector3d::Ones(), half = one / 2;
  Reference two = of_box(-half, half);
  two.add(of_box(zero, one), 1);
  two.add(of_box(zero, half), -1);
  const Vector3d low(0.1, -0.7, -0.2), high(0.1 + 1.0 / 3, 0.7, 0.3);
  Reference cross = of_box(-half, half);
  cross.add(of_box(low, high), 1);
  cross.add(of_box({low.x(), -0.5, low.z()}, {high.x(), 0.5, high.z()}), -1);
  struct Case {
    TriangleMesh mesh;
    Reference expected;
  };
  for (const Case& c : {Case{testing::overlapping_cubes_mesh(), two},
                        Case{joined(testing::cube_mesh(), box_mesh(low, high)), cross}}) {
    const MassProperties found = mass_properties(asset_of(c.mesh, "shells").view());
    expect_within_errors(found, c.expected);
    expect_near(found, c.expected, 1, 1e-6);
    EXPECT_LT(found.inertia_error, 3e-3 * found.inertia.trace());
  }
}

TEST(MassProperties, OfASolidWithoutAMesh) {
  const Vector3d middle(0.2, 0.1, 0);
  PackingSettings settings;
  settings.max_spheres = 300;
  const Asset asset = bake(*make_ball(middle, 1), settings);
  const MassProperties found = mass_properties(asset.view());
  const double moment = 8 * std::numbers::pi / 15;
  EXPECT_LE((found.centre_of_mass - middle).cwiseAbs().maxCoeff(), found.centre_of_mass_error);
  EXPECT_LE((found.centre_of_mass - middle).norm(), 1e-3);
  EXPECT_LE((found.inertia - moment * Matrix3d::Identity()).cwiseAbs().maxCoeff(),
            found.inertia_error);
  EXPECT_LE((found.inertia - moment * Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.01 * moment);
  EXPECT_LT(found.inertia_error, moment);
  const Bounds held = bounds(asset.view());
  EXPECT_LE(held.lower.x(), middle.x() - 1);
  EXPECT_GE(held.upper.y(), middle.y() + 1);
  EXPECT_GE(held.radius, 1 + (held.centre - middle).norm());
  EXPECT_LT(held.radius, 1.1);
}

TEST(MassProperties, InTheWorld) {
  const Vector3d lower(0.1, 0.2, -0.7), upper(3.3, 0.4, 0.9);
  const Asset asset = asset_of(box_mesh(lower, upper), "box");
  const Matrix3d turn =
      Eigen::AngleAxisd(1.1, Vector3d(-1, 2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Quaterniond q(turn);
  const double scale = 1.7;
  const PlacedAsset placed{asset.view(), {{q.w(), q.x(), q.y(), q.z()}, {4, -5, 6}}, scale};
  TriangleMesh moved = box_mesh(lower, upper);
  for (Vector3d& v : moved.vertices) v = turn * (scale * v) + Vector3d(4, -5, 6);
  const Reference expected = by_quadrature(moved);
  expect_near(mass_properties(placed), expected, 10, 1e-14);
  const Bounds held = bounds(placed);
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : moved.vertices) {
    box.extend(v);
    EXPECT_LE((v - held.centre).norm(), held.radius + 1e-12);
  }
  EXPECT_LE((held.lower - box.min()).norm() + (held.upper - box.max()).norm(), 1e-13);

  PlacedAsset wrong = placed;
  for (double& q : wrong.pose.q) q = 0;
  EXPECT_TRUE(std::isnan(mass_properties(wrong).volume));
  EXPECT_TRUE(mass_properties(wrong).inertia.hasNaN());
  EXPECT_TRUE(std::isnan(bounds(wrong).radius));
  wrong = placed;
  wrong.scale = 0;
  EXPECT_TRUE(std::isnan(mass_properties(wrong).volume));
  EXPECT_TRUE(std::isnan(mass_properties(PlacedAsset()).volume));
  EXPECT_EQ(mass_properties(AssetView()).inertia, Matrix3d(Matrix3d::Zero()));
  EXPECT_EQ(bounds(AssetView()).radius, 0);
}

TEST(Bounds, BallsAreTheSmallest) {
  EXPECT_NEAR(bounds(asset_of(testing::cube_mesh(), "cube").view()).radius, std::sqrt(0.75), 1e-9);
  const Bounds torus = bounds(asset_of(testing::torus_mesh(2, 0.5, 64, 32), "torus").view());
  EXPECT_NEAR(torus.radius, 2.5, 1e-9);
  EXPECT_LE(torus.centre.norm(), 1e-6);
}

}  // namespace
}  // namespace ist
