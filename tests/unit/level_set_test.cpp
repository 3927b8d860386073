#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <ist/solid.h>
#include <ist/types.h>

#include "mesh/mesh_solid.h"
#include "support/float_traps.h"

namespace {

using Eigen::Vector3d;
using ist::DistanceGrid;

/// A solid's distances, cut off at `band` [u], on a grid of `cells` cells along the longest side.
DistanceGrid sampled(const ist::Solid& solid, unsigned cells, double band) {
  const Eigen::AlignedBox3d box = solid.bounds();
  DistanceGrid grid;
  grid.spacing = box.sizes().maxCoeff() / cells;
  grid.origin = box.min() - Vector3d::Constant(1.3 * grid.spacing);
  for (std::size_t k = 0; k < 3; ++k)
    grid.size[k] = static_cast<std::uint32_t>(box.sizes()[static_cast<int>(k)] / grid.spacing) + 5;
  for (unsigned z = 0; z < grid.size[2]; ++z)
    for (unsigned y = 0; y < grid.size[1]; ++y)
      for (unsigned x = 0; x < grid.size[0]; ++x)
        grid.values.push_back(static_cast<float>(std::clamp(
            solid.signed_distance(grid.origin + grid.spacing * Vector3d(x, y, z)), -band, band)));
  return grid;
}

TEST(LevelSet, BandsAndWholeGridsGiveTheSolid) {
  const auto torus = ist::make_torus({0.1, 0.2, 0}, 0.7, 0.3);
  const auto cut = ist::make_difference(ist::make_box({0, 0, 0}, {1, 0.7, 0.4}),
                                        ist::make_ball({1, 0.7, 0.4}, 0.5));
  for (const ist::Solid* solid : {torus.get(), cut.get()})
    for (const double band : {10.0, 0.1}) {
      const DistanceGrid grid = sampled(*solid, 36, band);
      const ist::LevelSetMesh made = ist::mesh_level_set(grid, "grid");
      EXPECT_LE(made.error, 0.8 * grid.spacing);
      EXPECT_EQ(made.mesh.report.boundary_edges, 0u);
      const ist::MeshSolid mesh(made.mesh);
      EXPECT_NEAR(mesh.volume() / solid->volume(), 1, 0.01);
      // The mesh lies by the interpolation, and that by the solid.
      for (const Vector3d& v : made.mesh.mesh.vertices)
        ASSERT_LE(std::abs(solid->signed_distance(v)), made.error + 0.5 * grid.spacing);
      std::mt19937_64 random(1);
      std::uniform_real_distribution<double> coordinate(-1, 1);
      for (int i = 0; i < 1500; ++i) {
        const Vector3d x(coordinate(random), coordinate(random), coordinate(random));
        const double s = solid->signed_distance(x);
        ASSERT_TRUE(std::abs(s) <= made.error + 0.5 * grid.spacing ||
                    (s < 0) == mesh.inside(mesh.frame().to_unit(x)));
      }
    }
}

TEST(LevelSet, AGridOfAnyFunctionHasItsLevelSet) {
  // x² − r²: no distance, and 0 at points of the lattice.
  DistanceGrid grid;
  grid.size = {21, 21, 21};
  grid.origin = {-10, -10, -10};
  grid.spacing = 1;
  for (int i = 0; i < 21 * 21 * 21; ++i) {
    const Vector3d x(i % 21 - 10, i / 21 % 21 - 10, i / 441 - 10);
    grid.values.push_back(static_cast<float>(x.squaredNorm() - 49));
  }
  const ist::LevelSetMesh made = ist::mesh_level_set(grid, "parabola");
  const auto solid = ist::make_grid_solid(grid);
  ASSERT_NE(solid->mesh(), nullptr);
  EXPECT_NEAR(solid->volume(), 4 * 3.14159265358979 / 3 * 343, 0.04 * solid->volume());
  for (const Vector3d& v : made.mesh.mesh.vertices) EXPECT_NEAR(v.norm(), 7, 0.1);
  EXPECT_LE(made.error, 1.8);
}

/// A checkerboard of points inside: every face of every cell between them is in doubt.
TEST(LevelSet, NoiseIsClosedToo) {
  for (int seed = 0; seed < 4; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    DistanceGrid grid;
    grid.size = {9, 8, 7};
    grid.spacing = 0.5;
    for (unsigned i = 0; i < 9 * 8 * 7; ++i) {
      const unsigned x = i % 9, y = i / 9 % 8, z = i / 72;
      const bool border = x == 0 || y == 0 || z == 0 || x == 8 || y == 7 || z == 6;
      const float value =
          seed == 0 ? ((x + y + z) % 2 == 0 ? -1.0f : 1.0f)
                    : static_cast<float>(static_cast<double>(random() >> 11) * -0x1p-52 + 1);
      grid.values.push_back(border ? 1.0f : value);
    }
    EXPECT_NO_THROW(ist::mesh_level_set(grid, "noise")) << seed;  // close_mesh demands a cycle
  }
}

TEST(LevelSet, RefusesWhatIsNoLevelSet) {
  const ist::testing::NoFloatTraps with_nan;
  const DistanceGrid good = sampled(*ist::make_ball({0, 0, 0}, 1), 12, 10);
  const auto refused = [&](auto change, const std::string& why) {
    DistanceGrid bad = good;
    change(bad);
    try {
      ist::mesh_level_set(bad, "bad grid");
      ADD_FAILURE() << "accepted: " << why;
    } catch (const ist::Error& error) {
      EXPECT_NE(std::string(error.what()).find("bad grid: "), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
  };
  refused([](DistanceGrid& g) { g.values.pop_back(); }, "values");
  refused([](DistanceGrid& g) { g.values[77] = NAN; }, "not finite");
  refused([](DistanceGrid& g) { g.values[77] = INFINITY; }, "not finite");
  refused([](DistanceGrid& g) { g.values[0] = -1; }, "border at point (0 0 0)");
  refused([](DistanceGrid& g) { g.spacing = 0; }, "spacing");
  refused([](DistanceGrid& g) { g.origin[1] = NAN; }, "origin");
  refused([](DistanceGrid& g) { g.size[1] = 1; }, "along an axis");
  refused([](DistanceGrid& g) { g.size = {1u << 20, 1u << 20, 1u << 20}; }, "2^31");
  refused([](DistanceGrid& g) { g.values.assign(g.values.size(), 1.0f); }, "no point");
  EXPECT_THROW(ist::mesh_level_set(good, "", [](const ist::Progress&) { return false; }),
               ist::Error);
}

}  // namespace
