#include "packing/calibrate/calibration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <numbers>
#include <random>

#include <ist/bake.h>
#include <ist/types.h>

#include "base/elementary.h"
#include "packing/calibrate/host_calibration.h"
#include "support/on_host.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::box_mesh;
using testing::calibrate_on_host;
using testing::closed;

double volume_of_ball(double r) { return 4 * std::numbers::pi / 3 * r * r * r; }

Vector3d centre(const Sphere& s) { return {s.x, s.y, s.z}; }

double volume_sum(const Calibration& calibration) {
  double sum = 0;
  for (const Sphere& s : calibration.matched) sum += volume_of_ball(s.r);
  return sum;
}

Vector3d centre_of_mass(const Calibration& calibration) {
  Vector3d sum = Vector3d::Zero();
  for (const Sphere& s : calibration.matched) sum += volume_of_ball(s.r) * centre(s);
  return sum / volume_sum(calibration);
}

std::vector<Sphere> packed(const MeshSolid& solid, std::size_t count) {
  PackingSettings settings;
  settings.max_spheres = count;
  return pack(solid, settings).spheres;
}

Calibration calibrated(const MeshSolid& solid, std::size_t count) {
  return calibrate_on_host(solid, packed(solid, count));
}

TriangleMesh moved(TriangleMesh mesh, const Eigen::Affine3d& motion) {
  for (Vector3d& v : mesh.vertices) v = motion * v;
  return mesh;
}

/// Random turns, the axes' own first.
Eigen::Affine3d turn(int k) {
  const double quarter = std::numbers::pi / 2;
  const Vector3d axes[3] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  if (k < 3) return Eigen::Affine3d(Eigen::AngleAxisd(quarter, axes[k]));
  return Eigen::Affine3d(Eigen::AngleAxisd(0.7 * k, Vector3d(1, 0.3 * k, -0.2).normalized()));
}

TEST(CubeRoot, IsAccurate) {
  for (double x = 1e-30; x < 1e30; x *= 1.37) EXPECT_NEAR(cube_root(x) / std::cbrt(x), 1, 1e-15);
  EXPECT_EQ(cube_root(0), 0);
  EXPECT_EQ(cube_root(8), 2);
  EXPECT_EQ(cube_root(HUGE_VAL), HUGE_VAL);
}

TEST(PowerCells, PiecesOfALineBelongToTheLeastPower) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<PowerSite> sites;
    std::vector<std::uint32_t> list;
    for (std::uint32_t k = 0; k < 12; ++k) {
      sites.push_back({uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(0, 0.2)});
      list.push_back(k);
    }
    if (trial % 2 == 0) sites[5] = sites[3];  // a twin gets nothing
    const double y = uniform(-1, 1), z = uniform(-1, 1);
    double reached = -0.9;
    cut_by_power_cells(sites.data(), list.data(), 12, y, z, -0.9, 0.8,
                       [&](std::uint32_t site, double from, double to) {
                         EXPECT_EQ(from, reached);
                         EXPECT_LT(from, to);
                         EXPECT_NE(site, trial % 2 == 0 ? 5u : 99u);
                         reached = to;
                         const double x = 0.5 * (from + to);
                         for (const PowerSite& other : sites)
                           EXPECT_LE(power(sites[site], x, y, z), power(other, x, y, z) + 1e-12);
                       });
    EXPECT_EQ(reached, 0.8);
  }
}

/// The subdivision must give every column the pieces that all sites together would.
TEST(PowerCells, SubdivisionLosesNoSite) {
  const MeshSolid solid(closed(testing::torus_mesh(1, 0.4, 48, 24), "torus"));
  const ColumnLattice lattice = cut_columns(solid, plan_columns(solid, 0.02, 1000, 1e6));
  std::vector<PowerSite> sites;
  std::vector<std::uint32_t> all;
  for (const Sphere& s : packed(solid, 300)) {
    all.push_back(static_cast<std::uint32_t>(sites.size()));
    sites.push_back({s.x, s.y, s.z, double{s.r} * s.r});
  }
  for (const std::size_t twin : {std::size_t{3}, std::size_t{200}}) {  // they win nothing
    all.push_back(static_cast<std::uint32_t>(sites.size()));
    sites.push_back(PowerSite(sites[twin]));
  }
  std::vector<double> lengths(sites.size());
  for (std::uint32_t j = 0; j < lattice.lines.nz; ++j)
    for (std::uint32_t i = 0; i < lattice.lines.ny; ++i)
      for (std::uint32_t s = lattice.first[j * lattice.lines.ny + i];
           s < lattice.first[j * lattice.lines.ny + i + 1]; ++s)
        cut_by_power_cells(
            sites.data(), all.data(), static_cast<std::uint32_t>(all.size()), lattice.y(i, j),
            lattice.z(j), lattice.spans[s].x0, lattice.spans[s].x1,
            [&](std::uint32_t site, double from, double to) { lengths[site] += to - from; });
  const PowerOctree octree(lattice);
  const std::vector<PowerSums> sums = octree.cell_sums(sites);
  for (std::size_t k = 0; k < sites.size(); ++k)
    EXPECT_NEAR(static_cast<double>(sums[k].length) / octree.grid().to_fixed, lengths[k],
                1e-9 * lattice.length)
        << k;
}

TEST(ColumnLattice, MeasuresVolumes) {
  const MeshSolid cubes(closed(testing::overlapping_cubes_mesh(), "cubes"));
  const ColumnLattice lattice = cut_columns(cubes, plan_columns(cubes, 0.01, 1000, 1e6));
  const double scale = cubes.frame().scale();
  EXPECT_NEAR(lattice.volume() * scale * scale * scale, 1.875, 2e-3);  // the overlap counts once
  const MeshSolid box(closed(testing::cube_mesh(), "cube"));
  EXPECT_NEAR(cut_columns(box, plan_columns(box, 0.05, 1, 1e6)).volume(), box.unit_volume(), 1e-12);
}

TEST(Calibration, OneSphereStandsForABall) {
  const MeshSolid solid(closed(testing::icosphere_mesh(4), "ball"));
  const Sphere off = {0.1f, -0.05f, 0.02f, 0.3f};  // wherever the inner sphere is
  const Calibration result = calibrate_on_host(solid, {&off, 1});
  ASSERT_EQ(result.matched.size(), 1u);
  EXPECT_NEAR(centre(result.matched[0]).norm(), 0, 2e-4);
  EXPECT_NEAR(volume_of_ball(result.matched[0].r) / solid.unit_volume(), 1, 1e-6);
  EXPECT_GT(result.protrusion, 0);     // the ball of equal volume crosses the facets
  EXPECT_LT(result.protrusion, 3e-3);  // by less than their sagitta and the lattice's error
}

TEST(Calibration, EightSpheresQuarterACube) {
  const MeshSolid solid(closed(testing::cube_mesh(), "cube"));
  std::vector<Sphere> inner;
  for (int k = 0; k < 8; ++k)
    inner.push_back({(k & 1) != 0 ? 0.25f : -0.25f, (k & 2) != 0 ? 0.25f : -0.25f,
                     (k & 4) != 0 ? 0.25f : -0.25f, 0.2f});
  const Calibration result = calibrate_on_host(solid, inner);
  const double half = 0.5 / solid.frame().scale();
  for (std::size_t k = 0; k < 8; ++k) {
    EXPECT_NEAR(volume_of_ball(result.matched[k].r) / solid.unit_volume(), 0.125, 2e-3);
    const Vector3d expected(inner[k].x, inner[k].y, inner[k].z);
    EXPECT_LT((centre(result.matched[k]) - expected.cwiseSign() * half / 2).norm(), 5e-3);
  }
}

TEST(Calibration, KeepsVolumeAndCentreOfMass) {
  struct Case {
    TriangleMesh mesh;
    Vector3d centre;  // of mass, [u]
    std::size_t spheres;
  };
  const Vector3d cubes_centre = Vector3d::Constant((1 * 0.0 + 1 * 0.5 - 0.125 * 0.25) / 1.875);
  const Vector3d zero = Vector3d::Zero();
  for (const Case& c :
       {Case{testing::cube_mesh(), zero, 1}, Case{testing::cube_mesh(), zero, 500},
        Case{testing::torus_mesh(1, 0.3, 64, 32), zero, 200},
        Case{testing::overlapping_cubes_mesh(), cubes_centre, 300},
        Case{testing::joined(testing::icosphere_mesh(3),
                             testing::inverted(moved(testing::icosphere_mesh(3),
                                                     Eigen::Affine3d(Eigen::UniformScaling(0.5))))),
             zero, 300}}) {
    const MeshSolid solid(closed(c.mesh, "case"));
    const Calibration result = calibrated(solid, c.spheres);
    const double allowed = 1e-6 + solid.unit_moments().volume_error / solid.unit_volume();
    EXPECT_NEAR(volume_sum(result) / solid.unit_volume(), 1, allowed);
    EXPECT_LT((centre_of_mass(result) - solid.frame().to_unit(c.centre)).norm(), 1e-3);
    for (const Sphere& s : result.matched) EXPECT_GT(s.r, 0);
  }
}

TEST(Calibration, ProtrusionHoldsOnTheSurfacesOfSpheres) {
  const MeshSolid solid(closed(testing::torus_mesh(1, 0.3, 64, 32), "torus"));
  const Calibration result = calibrated(solid, 100);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  double farthest = 0;
  for (const Sphere& s : result.matched)
    for (int k = 0; k < 100; ++k) {
      const Vector3d x =
          centre(s) +
          double{s.r} * Vector3d(normal(random), normal(random), normal(random)).normalized();
      if (!solid.inside(x)) farthest = std::max(farthest, solid.closest_point(x).distance);
    }
  EXPECT_LE(farthest, result.protrusion);
  EXPECT_GT(farthest, 0.3 * result.protrusion);  // and the bound is not idle
}

TEST(Calibration, SameBytesForAnyThreadCount) {
  const MeshSolid solid(closed(testing::torus_mesh(1, 0.3, 64, 32), "torus"));
  const std::vector<Sphere> inner = packed(solid, 700);
  const Calibration one = calibrate_on_host(solid, inner, 1);
  for (const unsigned threads : {2u, 3u, 8u}) {
    const Calibration many = calibrate_on_host(solid, inner, threads);
    EXPECT_EQ(
        std::memcmp(one.matched.data(), many.matched.data(), one.matched.size() * sizeof(Sphere)),
        0);
    EXPECT_EQ(one.protrusion, many.protrusion);
  }
}

TEST(Calibration, ScaleByAPowerOfTwoChangesNothing) {
  const TriangleMesh mesh = testing::torus_mesh(1, 0.3, 64, 32);
  const MeshSolid solid(closed(mesh, "torus"));
  const MeshSolid large(closed(moved(mesh, Eigen::Affine3d(Eigen::UniformScaling(0x1p30))), "big"));
  const std::vector<Sphere> inner = packed(solid, 100);
  const Calibration a = calibrate_on_host(solid, inner), b = calibrate_on_host(large, inner);
  EXPECT_EQ(std::memcmp(a.matched.data(), b.matched.data(), 100 * sizeof(Sphere)), 0);
}

/// A plate of any thickness, rotated in any direction, is divided evenly among an even grid of
/// spheres.
TEST(Calibration, MeasuresThinPlates) {
  for (const double thickness : {1e-2, 1e-6})
    for (int k = 0; k < 8; ++k) {
      const Vector3d half(0.5, 0.5, thickness / 2);
      const MeshSolid solid(closed(moved(box_mesh(-half, half), turn(k)), "plate"));
      std::vector<Sphere> inner;
      for (int i = 0; i < 25; ++i) {
        const Vector3d x = solid.frame().to_unit(
            turn(k) * Vector3d(-0.4 + 0.2 * (i % 5), -0.4 + 0.2 * (i / 5), 0));
        inner.push_back({static_cast<float>(x.x()), static_cast<float>(x.y()),
                         static_cast<float>(x.z()), static_cast<float>(0.4 * thickness)});
      }
      const Calibration result = calibrate_on_host(solid, inner);
      EXPECT_NEAR(volume_sum(result) / solid.unit_volume(), 1, 1e-6);
      for (std::size_t i = 0; i < inner.size(); ++i) {
        const Vector3d expected(inner[i].x, inner[i].y, inner[i].z);
        EXPECT_NEAR(25 * volume_of_ball(result.matched[i].r) / solid.unit_volume(), 1, 0.05)
            << "thickness " << thickness << ", turn " << k;
        EXPECT_LT((centre(result.matched[i]) - expected).norm(), 0.01)
            << "thickness " << thickness << ", turn " << k;
      }
    }
}

TEST(Calibration, MeasuresNeedles) {
  for (int k = 0; k < 8; ++k) {
    const Vector3d half(0.5, 0.5e-6, 0.5e-6);
    const MeshSolid solid(closed(moved(box_mesh(-half, half), turn(k)), "needle"));
    std::vector<Sphere> inner;
    for (int i = 0; i < 10; ++i) {
      const Vector3d x = solid.frame().to_unit(turn(k) * Vector3d(-0.45 + 0.1 * i, 0, 0));
      inner.push_back({static_cast<float>(x.x()), static_cast<float>(x.y()),
                       static_cast<float>(x.z()), 0.4e-6f});
    }
    const Calibration result = calibrate_on_host(solid, inner);
    EXPECT_NEAR(volume_sum(result) / solid.unit_volume(), 1, 1e-6);
    for (std::size_t i = 0; i < inner.size(); ++i) {
      EXPECT_NEAR(10 * volume_of_ball(result.matched[i].r) / solid.unit_volume(), 1, 0.05) << k;
      EXPECT_LT((centre(result.matched[i]) - Vector3d(inner[i].x, inner[i].y, inner[i].z)).norm(),
                0.01)
          << k;
    }
  }
}

/// A sphere whose cell is empty (a twin) is still legal, and takes nothing from the sum.
TEST(Calibration, EmptyCellsAreLegal) {
  const MeshSolid solid(closed(testing::cube_mesh(), "cube"));
  const std::vector<Sphere> inner = {{0, 0, 0, 0.3f}, {0, 0, 0, 0.3f}, {0, 0, 0, 0.1f}};
  const Calibration result = calibrate_on_host(solid, inner);
  EXPECT_NEAR(volume_sum(result) / solid.unit_volume(), 1, 1e-6);
  EXPECT_GT(result.matched[1].r, 0);
  EXPECT_GT(result.matched[2].r, 0);
}

TEST(Calibration, CancelAndNoSpheresAreErrors) {
  const MeshSolid solid(closed(testing::cube_mesh(), "cube"));
  const Sphere ball = {0, 0, 0, 0.5f};
  EXPECT_THROW(calibrate_on_host(solid, {&ball, 1}, 0, [](const Progress&) { return false; }),
               Error);
  EXPECT_THROW(calibrate_on_host(solid, {}), Error);
}

}  // namespace
}  // namespace ist
