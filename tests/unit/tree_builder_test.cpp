#include "bake/cluster/tree_builder.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>

#include "bake/cluster/ball_lanes.h"

namespace ist {
namespace {

std::vector<Sphere> random_spheres(std::size_t n, unsigned seed) {
  std::mt19937 bits(seed);
  const auto unit = [&] { return static_cast<double>(bits()) / 4294967296.0; };
  std::vector<Sphere> spheres(n);
  for (Sphere& s : spheres) {
    const auto coordinate = [&] { return static_cast<float>(2 * unit() - 1); };
    s = {coordinate(), coordinate(), coordinate(), 0};
    s.r = static_cast<float>(0.1 / (1 + 99 * unit()));
  }
  return spheres;
}

class TreeOfCount : public ::testing::TestWithParam<std::size_t> {};

// Every node's ball contains every sphere and cover ball below it, in double, for any count.
TEST_P(TreeOfCount, BallsHoldWhatIsBelow) {
  const std::size_t n = GetParam();
  const auto spheres = random_spheres(n, static_cast<unsigned>(n));
  std::vector<float> covers(n);
  for (std::size_t i = 0; i < n; ++i) covers[i] = spheres[i].r * 1.5f;
  const TreeArrays tree = build_tree(spheres, covers);

  std::set<std::uint32_t> seen;
  for (std::size_t i = 0; i < n; ++i) {
    const BallBlock& block = tree.levels[0].blocks[i / kWidth];
    const Origin& origin = tree.levels[0].origins[i / kWidth];
    const Sphere& s = spheres[tree.sphere_index[i]];
    EXPECT_TRUE(seen.insert(tree.sphere_index[i]).second);
    EXPECT_EQ(origin.x + block.x[i % kWidth], s.x);
    EXPECT_EQ(origin.y + block.y[i % kWidth], s.y);
    EXPECT_EQ(origin.z + block.z[i % kWidth], s.z);
    EXPECT_EQ(block.r[i % kWidth], s.r);
    EXPECT_EQ(tree.sphere_cover[i], covers[tree.sphere_index[i]]);
  }
  std::size_t span = kWidth;
  for (std::size_t k = 1; k < tree.levels.size(); ++k, span *= kWidth) {
    const TreeLevelArrays& level = tree.levels[k];
    for (std::size_t i = 0; i < tree.levels[k - 1].blocks.size(); ++i) {
      const BallBlock& block = level.blocks[i / kWidth];
      const Origin& origin = level.origins[i / kWidth];
      const std::size_t l = i % kWidth;
      double volume = 0;
      for (std::size_t j = i * span; j < std::min(n, (i + 1) * span); ++j) {
        const Sphere& s = spheres[tree.sphere_index[j]];
        const double d = reach(origin.x + block.x[l], origin.y + block.y[l], origin.z + block.z[l],
                               {s.x, s.y, s.z, 0});
        EXPECT_LE(d + s.r, block.r[l]);
        EXPECT_LE(d + tree.sphere_cover[j], level.nodes[i / kWidth].cover[l]);
        volume += 4 * M_PI / 3 * s.r * s.r * s.r;
      }
      EXPECT_LE(volume, level.nodes[i / kWidth].volume[l]);
      EXPECT_GE(volume * (1 + 1e-6), level.nodes[i / kWidth].volume[l]);
    }
  }
  EXPECT_EQ(tree.levels.back().blocks.size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(Counts, TreeOfCount,
                         ::testing::Values(1, 2, 15, 16, 17, 31, 32, 33, 255, 256, 257, 300, 4095,
                                           4096, 4097, 5000));

/// Σ r³ over the balls of one level.
double cost(const TreeArrays& tree, std::size_t level) {
  double sum = 0;
  const std::size_t count = tree.levels[level - 1].blocks.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double r = tree.levels[level].blocks[i / kWidth].r[i % kWidth];
    sum += r * r * r;
  }
  return sum;
}

// A group that is not full, left in the middle, would shift every group behind it across two
// clusters: still a sound tree, but a bad one.
TEST(TreeOrder, OneSphereMoreCostsLittle) {
  const TreeArrays full = build_tree(random_spheres(4096, 1), {});
  for (const std::size_t n : {4097u, 4111u, 4113u}) {
    const TreeArrays tree = build_tree(random_spheres(n, 1), {});
    for (const std::size_t level : {1u, 2u})
      EXPECT_LT(cost(tree, level), 1.15 * cost(full, level)) << n << " level " << level;
  }
}

TEST(TreeOrder, SwapsShrinkBalls) {
  const auto spheres = random_spheres(3000, 2);
  EXPECT_LT(cost(build_tree(spheres, {}, true), 1), 0.95 * cost(build_tree(spheres, {}, false), 1));
}

// Spheres that lie as others do but for a third of a radius, and have other radii: from the others'
// order one that is as good as their own, and better than the others' as it is.
TEST(TreeOrder, OfSpheresThatLieAlikeIsAsGood) {
  for (const std::size_t n : {1u, 16u, 17u, 256u, 257u, 3000u, 4113u}) {
    const std::vector<Sphere> others = random_spheres(n, 3);
    const std::vector<Sphere> shifts = random_spheres(n, 4);
    std::vector<Sphere> spheres = others;
    for (std::size_t i = 0; i < n; ++i) {
      const float third = spheres[i].r / 3;
      spheres[i].x += third * shifts[i].x;
      spheres[i].y += third * shifts[i].y;
      spheres[i].z += third * shifts[i].z;
      spheres[i].r *= 1 + 5 * shifts[i].r;
    }
    const std::vector<std::uint32_t> order = sphere_order(others);
    const TreeArrays own = build_tree(spheres, {}), alike = build_tree_like(spheres, order),
                     as_it_is = tree_from_order(spheres, {}, order);
    std::set<std::uint32_t> seen(alike.sphere_index.begin(),
                                 alike.sphere_index.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_EQ(seen.size(), n);
    ASSERT_EQ(alike.levels.size(), own.levels.size());
    const auto whole_cost = [](const TreeArrays& tree) {
      double sum = 0;
      for (std::size_t level = 1; level < tree.levels.size(); ++level) sum += cost(tree, level);
      return sum;
    };
    EXPECT_LE(whole_cost(alike), 1.03 * whole_cost(own)) << n;
    if (n > 256) {
      EXPECT_LT(cost(alike, 1), cost(as_it_is, 1)) << n;
      EXPECT_NE(alike.sphere_index, own.sphere_index) << n;  // not one made from nothing
    }
  }
}

/// All numbers of a tree that its order and its balls decide.
std::vector<double> numbers_of(const TreeArrays& tree) {
  std::vector<double> numbers(tree.sphere_index.begin(), tree.sphere_index.end());
  for (const TreeLevelArrays& level : tree.levels)
    for (const BallBlock& block : level.blocks)
      for (const auto& values : {block.x, block.y, block.z, block.r})
        numbers.insert(numbers.end(), values, values + kWidth);
  for (const TreeLevelArrays& level : tree.levels)
    for (const NodeBlock& nodes : level.nodes)
      numbers.insert(numbers.end(), nodes.overlap, nodes.overlap + kWidth);
  numbers.insert(numbers.end(), tree.root, tree.root + 4);
  return numbers;
}

// Vectors of any width make the same tree, of spheres at random and of a lattice's, where many are
// equally near.
TEST(TreeOrder, IsTheSameOnEveryInstructionSet) {
  std::vector<Sphere> lattice;
  for (int i = 0; i < 1331; ++i)
    lattice.push_back({static_cast<float>(i % 11) / 16, static_cast<float>(i / 11 % 11) / 16,
                       static_cast<float>(i / 121) / 16, 1.0f / 24});
  for (const std::vector<Sphere>& spheres : {random_spheres(1500, 5), lattice}) {
    std::vector<double> first;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(hwy::SupportedTargets());
      const std::vector<double> numbers = numbers_of(build_tree(spheres, {}));
      if (first.empty()) first = numbers;
      EXPECT_EQ(numbers, first) << hwy::TargetName(target);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
}

// No random point lies in more spheres of a node than its κ, and κ is not idle.
TEST(OverlapBound, HoldsAtRandomPoints) {
  const auto spheres = random_spheres(1500, 7);
  std::vector<Ball> sorted;
  const TreeArrays tree = build_tree(spheres, {});
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const Sphere& s = spheres[tree.sphere_index[i]];
    sorted.push_back({s.x, s.y, s.z, s.r});
  }
  std::mt19937 bits(3);
  const auto unit = [&] { return static_cast<double>(bits()) / 2147483648.0 - 1; };
  float most = 0;
  for (int trial = 0; trial < 300'000; ++trial) {
    const Ball& home = sorted[bits() % sorted.size()];
    const double x = home.x + home.r * unit();
    const double y = home.y + home.r * unit();
    const double z = home.z + home.r * unit();
    std::vector<std::size_t> inside;
    for (std::size_t i = 0; i < sorted.size(); ++i)
      if (reach(x, y, z, {sorted[i].x, sorted[i].y, sorted[i].z, 0}) < sorted[i].r)
        inside.push_back(i);
    most = std::max(most, static_cast<float>(inside.size()));
    for (std::size_t k = 0; k + 1 < tree.levels.size(); ++k)
      for (const std::size_t i : inside) {
        const std::size_t node = i >> (4 * (k + 1));
        const auto count = std::count_if(inside.begin(), inside.end(),
                                         [&](std::size_t j) { return j >> (4 * (k + 1)) == node; });
        EXPECT_LE(static_cast<float>(count),
                  tree.levels[k + 1].nodes[node / kWidth].overlap[node % kWidth]);
      }
  }
  EXPECT_LE(most, tree.overlap);
  EXPECT_LE(tree.overlap, most + 1);
}

// The ball is as small as a fine search for a better centre can make it.
TEST(BoundingBall, IsSmallest) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto spheres = random_spheres(2 + seed % 40, seed);
    std::vector<Ball> balls;
    for (const Sphere& s : spheres) balls.push_back({s.x, s.y, s.z, s.r});
    const Ball ball = bounding_ball(balls);
    const auto radius_about = [&](double x, double y, double z) {
      double r = 0;
      for (const Ball& b : balls) r = std::max(r, reach(x, y, z, b));
      return r;
    };
    EXPECT_LE(radius_about(ball.x, ball.y, ball.z), ball.r * (1 + 1e-9));
    for (int axis = 0; axis < 3; ++axis)  // the radius is convex in the centre
      for (const double step : {-1e-5, 1e-5})
        EXPECT_GE(radius_about(ball.x + (axis == 0) * step, ball.y + (axis == 1) * step,
                               ball.z + (axis == 2) * step),
                  ball.r * (1 - 1e-9));
  }
}

}  // namespace
}  // namespace ist
