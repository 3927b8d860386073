#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/team.h"
#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "packing/grids/host_grid.h"
#include "packing/grids/local_winding.h"
#include "packing/grids/nearest_primitive.h"
#include "packing/grids/pack_grids.h"
#include "support/test_meshes.h"

namespace ist::packing {
namespace {

std::vector<ClosedMesh> meshes() {
  using namespace testing;
  std::vector<ClosedMesh> all;
  all.push_back(closed(cube_mesh(), "cube"));
  all.push_back(closed(torus_mesh(1, 0.3, 20, 9), "torus"));
  all.push_back(closed(overlapping_cubes_mesh(), "overlapping cubes"));
  all.push_back(closed(joined(icosphere_mesh(2), inverted(icosphere_mesh(0))), "touching shells"));
  all.push_back(close_mesh(make_sample("bolt"), "bolt"));
  return all;
}

GridLayout layout_of(const MeshSolid& solid, int cells) {
  const Eigen::Vector3d lower = solid.frame().to_unit(solid.bounds().min());
  const Eigen::Vector3d upper = solid.frame().to_unit(solid.bounds().max());
  return make_grid_layout(lower.data(), upper.data(), cells, 0);
}

Float3 random_point(std::mt19937& random, const GridLayout& g) {
  std::uniform_real_distribution<float> unit(0.001f, 0.999f);
  return {g.origin.x + unit(random) * g.size * static_cast<float>(g.n[0]),
          g.origin.y + unit(random) * g.size * static_cast<float>(g.n[1]),
          g.origin.z + unit(random) * g.size * static_cast<float>(g.n[2])};
}

/// Disjoint spheres inside the solid.
std::vector<Sphere> some_spheres(std::mt19937& random, const MeshSolid& solid, std::size_t count) {
  const GridLayout g = layout_of(solid, 4);
  std::vector<Sphere> spheres;
  for (int n = 0; n < 3000 && spheres.size() < count; ++n) {
    const Float3 p = random_point(random, g);
    const Eigen::Vector3d c(p.x, p.y, p.z);
    if (!solid.inside(c)) continue;
    double r = solid.closest_point(c).distance;
    for (const Sphere& s : spheres)
      r = std::min(r, (c - Eigen::Vector3d(s.x, s.y, s.z)).norm() - double{s.r});
    if (r > 0.01) spheres.push_back({p.x, p.y, p.z, static_cast<float>(0.999 * r)});
  }
  return spheres;
}

TEST(GridLayout, BordersAreExactAtEveryLevel) {
  const double lower[3] = {-0.713, -0.4, -1}, upper[3] = {0.713, 0.1, 0.93};
  for (const int start : {1, 4, 9, 37, 128}) {
    const int levels = start > 32 ? 3 : 5;
    const GridLayout first = make_grid_layout(lower, upper, start, levels);
    EXPECT_EQ(std::max({first.n[0], first.n[1], first.n[2]}), start);
    GridLayout g = first;
    for (int l = 0; l <= levels; ++l, g = refined(g))
      for (int i = 0; i <= g.n[0]; ++i) {
        const double exact = double{g.origin.x} + double(i) * double{g.size};
        ASSERT_EQ(double{g.low_x(i)}, exact) << start << " level " << l;
      }
    EXPECT_LT(first.low_x(0), lower[0]);
    EXPECT_GT(first.low_x(first.n[0]), upper[0]);
    EXPECT_GT(first.low_y(first.n[1]), upper[1]);
  }
}

TEST(DistanceGridTest, InsideAgreesWithTheExactWindingNumber) {
  std::mt19937 random(1);
  for (const ClosedMesh& mesh : meshes()) {
    const MeshSolid solid(mesh);
    for (const int cells : {1, 5, 16, 40}) {
      HostGrid grid(solid.view());
      grid.build(layout_of(solid, cells), {});
      const std::vector<Sphere> none;
      const GridScene scene = grid.scene(none);
      for (int n = 0; n < 2000; ++n) {
        Float3 p = random_point(random, scene.grid.layout);
        if (n % 4 == 0) {  // close to the surface
          const ClosestPoint q = solid.closest_point({p.x, p.y, p.z});
          p = {static_cast<float>(q.point.x()), static_cast<float>(q.point.y()),
               static_cast<float>(q.point.z())};
          p.x += static_cast<float>(n % 3 - 1) * 1e-6f;
        }
        const Eigen::Vector3d at(p.x, p.y, p.z);
        if (solid.closest_point(at).distance == 0) continue;
        ASSERT_EQ(inside_solid(SerialTeam{}, scene, p), solid.inside(at))
            << mesh.name << ", " << cells << " cells, " << at.transpose();
      }
    }
  }
}

TEST(DistanceGridTest, NearestIsTheLeastOverAllPrimitives) {
  std::mt19937 random(2);
  for (const ClosedMesh& mesh : meshes()) {
    const MeshSolid solid(mesh);
    const std::vector<Sphere> spheres = some_spheres(random, solid, 40);
    for (const int cells : {1, 6, 33}) {
      HostGrid grid(solid.view());
      grid.build(layout_of(solid, cells), {});
      grid.update(spheres, 0);
      const GridScene scene = grid.scene(spheres);
      for (int n = 0; n < 300; ++n) {
        const Float3 p = random_point(random, scene.grid.layout);
        if (!inside_solid(SerialTeam{}, scene, p)) continue;
        NearestPrimitive expected{1e10f, kNoTag};
        const auto look = [&](std::uint32_t tag) {
          const float d = distance_to(scene, tag, p);
          if (d < expected.distance || (d == expected.distance && tag < expected.tag))
            expected = {d, tag};
        };
        for (std::uint32_t i = 0; i < spheres.size(); ++i) look(i);
        for (std::uint32_t i = 0; i < solid.view().triangle_count; ++i) look(kTriangleTag | i);
        if (expected.distance < 0) continue;
        for (const std::uint32_t hint : {kNoTag, kTriangleTag, expected.tag}) {
          const NearestPrimitive found = nearest_primitive(SerialTeam{}, scene, p, hint);
          ASSERT_EQ(found.distance, expected.distance) << mesh.name << ", " << cells << " cells";
          ASSERT_EQ(found.tag, expected.tag);
        }
      }
    }
  }
}

TEST(DistanceGridTest, DiscreteDistancesAreManhattanDistances) {
  std::mt19937 random(3);
  const MeshSolid solid(testing::closed(testing::torus_mesh(1, 0.45, 24, 12), "torus"));
  const std::vector<Sphere> spheres = some_spheres(random, solid, 10);
  HostGrid grid(solid.view());
  grid.build(layout_of(solid, 24), spheres);
  const DistanceGrid d = grid.scene(spheres).grid;
  std::vector<std::array<int, 3>> border;
  std::size_t active = 0;
  const auto for_cells = [&](const auto& visit) {
    for (int k = 0; k < d.layout.n[2]; ++k)
      for (int j = 0; j < d.layout.n[1]; ++j)
        for (int i = 0; i < d.layout.n[0]; ++i)
          if (d.word(i, j, k) != DistanceGrid::kInactive) visit(i, j, k, d.word(i, j, k));
  };
  for_cells([&](int i, int j, int k, std::uint32_t word) {
    ++active;
    const CellRecord& r = d.records[DistanceGrid::slot(word)];
    if (r.triangle_count + r.sphere_count > 0) border.push_back({i, j, k});
  });
  EXPECT_EQ(active, grid.active_cells());
  int deepest = 0;
  for_cells([&](int i, int j, int k, std::uint32_t word) {
    int least = 1000;
    for (const auto& b : border)
      least = std::min(least, std::abs(b[0] - i) + std::abs(b[1] - j) + std::abs(b[2] - k));
    ASSERT_EQ(DistanceGrid::distance(word), least);
    deepest = std::max(deepest, least);
  });
  EXPECT_GE(deepest, 3);
}

TEST(DistanceGridTest, CoveredCellsAreGivenBackAndAFewStandInAHashTable) {
  const MeshSolid solid(testing::closed(testing::icosphere_mesh(3), "icosphere"));
  HostGrid grid(solid.view());
  grid.build(layout_of(solid, 112), {});
  const std::size_t before = grid.bytes(), active = grid.active_cells();
  EXPECT_FALSE(grid.hashed());
  const std::vector<Sphere> spheres = {{0, 0, 0, 0.97f}};
  grid.update(spheres, 0);
  EXPECT_LT(grid.active_cells(), active / 3);
  EXPECT_TRUE(grid.hashed());
  EXPECT_LT(grid.bytes(), before / 2);
}

TEST(GridScheduleTest, SizesArePickedFromTheSolidAndTheMemory) {
  GridFigures cube{{-1, -1, -1}, {1, 1, 1}, 8, 4'000'000, std::size_t{1} << 30};
  GridFigures rod{{-1, -0.1, -0.1}, {1, 0.1, 0.1}, 0.08, 1000, std::size_t{1} << 30};
  EXPECT_EQ(grid_schedule(GridMode::implicit_refinement, {}, cube).first.n[0], 4);
  EXPECT_EQ(grid_schedule(GridMode::implicit_refinement, {}, rod).first.n[0], 9);
  EXPECT_EQ(grid_schedule(GridMode::uniform, {}, cube).first.n[0], 64);
  EXPECT_EQ(grid_schedule(GridMode::uniform, {}, rod).first.n[0], 144);
  GridFigures poor = cube;
  poor.memory = 1 << 20;
  for (const GridMode mode : {GridMode::implicit_refinement, GridMode::hybrid}) {
    const GridSchedule rich_one = grid_schedule(mode, {}, cube);
    const GridSchedule poor_one = grid_schedule(mode, {}, poor);
    EXPECT_GT(rich_one.finest_distances, poor_one.finest_distances);
    EXPECT_EQ(rich_one.finest_prototypes, poor_one.finest_prototypes);
    EXPECT_EQ(rich_one.first.size, poor_one.first.size);
  }
  GridSettings asked;
  asked.start = 5;
  asked.resolution = 70;
  asked.refinements = 2;
  const GridSchedule s = grid_schedule(GridMode::implicit_refinement, asked, cube);
  EXPECT_EQ(s.level(s.distances).n[0], 80);
  EXPECT_EQ(s.level(s.finest_prototypes).n[0], 20);
}

}  // namespace
}  // namespace ist::packing
