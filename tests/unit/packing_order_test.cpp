// The packing's numerics are functions of sets: neither the order of lists, nor the hierarchy over
// the mesh, nor how many lanes work on a cell changes a bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "mesh/samples/samples.h"
#include "packing/banded/banded_packer.h"
#include "packing/banded/mesh_surface.h"
#include "packing/banded/wide_mesh_surface.h"
#include "support/fiber_team.h"
#include "support/host_wide_tree.h"

namespace ist::packing {
namespace {

std::mt19937 g_order(7);  // of ShuffledSpheres, which the packer makes for itself

/// Spheres in another order each time.
class ShuffledSpheres {
 public:
  ShuffledSpheres(const std::vector<Sphere>& spheres, const SphereGrid& grid)
      : spheres_(spheres), grid_(grid), seed_(static_cast<unsigned>(g_order())) {}

  std::uint32_t count() const { return static_cast<std::uint32_t>(spheres_.size()); }
  float reach() const { return grid_.layout().reach; }

  template <class Team, class Visit>
  void for_near(const Team&, Float3 x, Visit&& visit) const {
    std::vector<std::uint32_t> list;
    grid_.for_near(x, [&](std::uint32_t i) { list.push_back(i); });
    std::mt19937 random(seed_ ^ bits_of(x.x) ^ bits_of(x.y));
    std::shuffle(list.begin(), list.end(), random);
    for (const std::uint32_t i : list) visit(true, i, spheres_[i]);
  }

 private:
  const std::vector<Sphere>& spheres_;
  const SphereGrid& grid_;
  unsigned seed_;
};

/// GridSpheres for a team of any width: its lanes share the spheres.
class TeamSpheres {
 public:
  TeamSpheres(const std::vector<Sphere>& spheres, const SphereGrid& grid)
      : spheres_(spheres), grid_(grid) {}

  std::uint32_t count() const { return static_cast<std::uint32_t>(spheres_.size()); }
  float reach() const { return grid_.layout().reach; }

  template <class Team, class Visit>
  void for_near(const Team& team, Float3 x, Visit&& visit) const {
    std::uint32_t mine = 0;
    int count = 0;
    const auto hand_out = [&] {
      if (count > 0) visit(team.lane() < count, mine, spheres_[mine]);
      count = 0;
    };
    grid_.for_near(x, [&](std::uint32_t i) {
      if (count++ == team.lane()) mine = i;
      if (count == Team::kWidth) hand_out();
    });
    hand_out();
  }

 private:
  const std::vector<Sphere>& spheres_;
  const SphereGrid& grid_;
};

struct Shuffled {
  using Spheres = ShuffledSpheres;
  static void arrange(std::vector<std::uint32_t>& cells) {
    std::shuffle(cells.begin(), cells.end(), g_order);
  }
};

PackingLimits limits_of(const MeshSolid& solid, std::uint64_t spheres, double epsilon = 0) {
  PackingLimits limits;
  limits.volume = solid.unit_volume();
  limits.max_spheres = spheres;
  limits.epsilon = epsilon;
  return limits;
}

template <class Order, class Surface>
std::vector<Sphere> packed(const Surface& surface, const PackingLimits& limits) {
  Stage stage("pack", {});
  return BandedPacker<Surface, Order>(surface, limits, stage).run().spheres;
}

void expect_same(const std::vector<Sphere>& a, const std::vector<Sphere>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_EQ(std::memcmp(&a[i], &b[i], sizeof a[i]), 0) << "sphere " << i;
}

ClosedMesh sample_mesh(const char* name) { return close_mesh(make_sample(name), name); }

/// A cube: most comparisons in it are ties.
ClosedMesh cube_mesh() {
  ClosedMesh cube;
  cube.name = "cube";
  for (int i = 0; i < 8; ++i) cube.mesh.vertices.emplace_back(i & 1, i >> 1 & 1, i >> 2);
  cube.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                         {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return cube;
}

TEST(PackingOrder, ShuffledCellsAndListsGiveTheSameSpheres) {
  for (const ClosedMesh& mesh : {cube_mesh(), sample_mesh("nut")}) {
    const MeshSolid solid(mesh);
    const MeshSurface surface(solid);
    for (const double epsilon : {0.0, 0.3}) {
      const PackingLimits limits = limits_of(solid, 250, epsilon);
      expect_same(packed<AsFound>(surface, limits), packed<Shuffled>(surface, limits));
    }
  }
}

TEST(PackingOrder, AnotherHierarchyGivesTheSameSpheres) {
  for (const ClosedMesh& mesh : {cube_mesh(), sample_mesh("gear")}) {
    const MeshSolid solid(mesh);
    const ist::testing::HostWideTree wide(solid.view());
    const PackingLimits limits = limits_of(solid, 300);
    expect_same(packed<AsFound>(MeshSurface(solid), limits),
                packed<AsFound>(WideMeshSurface(wide.tree()), limits));
  }
}

/// Cells on random descents of the octree, processed by one thread and by a team of lanes.
template <int Width>
void expect_team_agrees(const char* name, int descents, unsigned seed) {
  const MeshSolid solid(sample_mesh(name));
  const ist::testing::HostWideTree wide(solid.view());
  const WideMeshSurface surface(wide.tree());
  const std::vector<Sphere> spheres = packed<AsFound>(surface, limits_of(solid, 300));
  const float reach = 3 * spheres.back().r;
  const SphereGrid grid(spheres, sphere_grid_layout(spheres.size(), reach));
  const TeamSpheres near(spheres, grid);
  const PrototypeField<WideMeshSurface, TeamSpheres> field(surface, near);
  using Scratch = CellScratch<std::uint32_t>;
  const SerialTeam one;
  std::mt19937 random(seed);
  ist::testing::Fibers<Width> fibers(seed);
  int states[3] = {};  // of settled, candidate, split
  for (int descent = 0; descent < descents; ++descent) {
    StoredCell<std::uint32_t> stored{};
    stored.cell.inside = surface.inside(one, stored.cell.centre);
    for (int level = 0; level < 9; ++level) {
      const float threshold = spheres.back().r * (0.3f + 0.1f * static_cast<float>(random() % 8));
      const float margin = 1.1f * threshold;
      const float largest = random() % 4 == 0 ? 2.0f : 1.5f * threshold;
      StoredCell<std::uint32_t> other = stored, child = stored, other_child = stored;
      const int k = static_cast<int>(random() % 8);
      CellState state{};
      {
        Scratch scratch;
        Cell cell = load_cell(one, stored, scratch);
        state = field.work(one, cell, scratch, threshold, margin, largest);
        store_cell(one, cell, scratch, stored);
        store_cell(one, field.child(one, cell, k, scratch.ring, &scratch.sample[0], margin),
                   scratch, child);
      }
      auto shared = std::make_unique<Scratch>();
      fibers.run([&](int lane) {
        const ist::testing::FiberTeam<Width> team(fibers, lane);
        Cell cell = load_cell(team, other, *shared);
        EXPECT_EQ(field.work(team, cell, *shared, threshold, margin, largest), state);
        store_cell(team, cell, *shared, other);
        const Cell octant = field.child(team, cell, k, shared->ring, &shared->sample[0], margin);
        store_cell(team, octant, *shared, other_child);
      });
      ++states[static_cast<int>(state)];
      const auto same = [](const StoredCell<std::uint32_t>& a, const StoredCell<std::uint32_t>& b) {
        const auto ring = [](const StoredCell<std::uint32_t>& c) {
          return c.cell.ring_size * sizeof c.ring[0];
        };
        return std::memcmp(&a.cell, &b.cell, sizeof a.cell) == 0 &&
               std::memcmp(a.ring, b.ring, ring(a)) == 0;
      };
      ASSERT_TRUE(same(stored, other)) << "descent " << descent << " level " << level;
      ASSERT_TRUE(same(child, other_child)) << "descent " << descent << " level " << level;
      stored = child;
    }
  }
  for (const int count : states) EXPECT_GT(count, 0);
}

TEST(PackingOrder, ATeamOfLanesDoesWhatOneThreadDoes) {
  expect_team_agrees<4>("nut", 60, 1);
  expect_team_agrees<32>("bolt", 12, 2);
}

TEST(PackingOrder, AFullSampleKeepsTheNearestOfAnyOrder) {
  // More spheres within the window than fit.
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int round = 0; round < 20; ++round) {
    std::vector<Sphere> spheres;
    for (int i = 0; i < 150; ++i) {
      // Coordinates on a coarse lattice: many distances are equal.
      const auto at = [&] { return std::round(8 * unit(random)) / 32; };
      spheres.push_back({at(), at(), at(), 0.001f});
    }
    const SphereGrid grid({}, sphere_grid_layout(1, 2));
    SphereGrid filled(spheres, grid.layout());
    const Float3 x{0.01f * unit(random), 0, 0};
    std::vector<std::pair<float, std::uint32_t>> expected;
    for (std::uint32_t i = 0; i < spheres.size(); ++i)
      expected.emplace_back(norm(x - Float3{spheres[i].x, spheres[i].y, spheres[i].z}) - 0.001f, i);
    std::sort(expected.begin(), expected.end());
    expected.resize(kSampleCapacity - 9);
    const auto check = [&](const Sample& s) {
      std::vector<std::pair<float, std::uint32_t>> seen;
      for (int i = 0; i < s.size; ++i) seen.emplace_back(s.at->distance[i], s.at->tag[i]);
      std::sort(seen.begin(), seen.end());
      EXPECT_EQ(seen, expected);
      EXPECT_EQ(s.clearance, expected[0].first);
    };
    SampleMemory memory;
    Sample s = sample_spheres(SerialTeam{}, x, ShuffledSpheres(spheres, filled), 10, 9, &memory);
    check(s);
    ist::testing::Fibers<32> fibers(static_cast<unsigned>(round));
    fibers.run([&](int lane) {
      const Sample mine = sample_spheres(ist::testing::FiberTeam<32>(fibers, lane), x,
                                         TeamSpheres(spheres, filled), 10, 9, &memory);
      if (lane == 0) s = mine;
    });
    check(s);
  }
}

}  // namespace
}  // namespace ist::packing
