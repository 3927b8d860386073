#include <ist/query.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "query/asset/sphere_tree.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/lod/level_blend.h"
#include "query/lod/level_chain.h"
#include "query/tree_overlap/descent.h"
#include "query/tree_overlap/open_runs.h"

namespace ist {
namespace {

using Balls = std::vector<NodeBall>;

Balls balls_of(const SphereTree& tree, int level, double scale) {
  Balls balls(tree.count(level));
  for (std::uint32_t i = 0; i < balls.size(); ++i) {
    balls[i] = tree.ball(level, i);
    for (double& x : balls[i].centre) x *= scale;
    balls[i].r *= scale;
  }
  return balls;
}

/// Upper bound on the number of balls that a ball of `radius` can overlap: the most that come as
/// near to one cell of a grid.
std::size_t most_overlaps(const Balls& balls, double radius) {
  constexpr double kCells = 4e5, kCellsAReach = 3;
  double low[3], size[3], sum = 0;
  for (int k = 0; k < 3; ++k) {
    double high = -HUGE_VAL;
    low[k] = HUGE_VAL;
    for (const NodeBall& ball : balls) {
      low[k] = std::min(low[k], ball.centre[k] - ball.r - radius);
      high = std::max(high, ball.centre[k] + ball.r + radius);
    }
    size[k] = high - low[k];
  }
  for (const NodeBall& ball : balls) sum += ball.r;
  const double typical = sum / static_cast<double>(balls.size());
  const double cell =
      std::max((radius + typical) / kCellsAReach, std::cbrt(size[0] * size[1] * size[2] / kCells));
  std::size_t count[3];
  for (int k = 0; k < 3; ++k) count[k] = static_cast<std::size_t>(size[k] / cell) + 1;
  std::vector<std::uint32_t> near(count[0] * count[1] * count[2]);
  for (const NodeBall& ball : balls) {
    const double reach = ball.r + radius;
    std::size_t first[3], last[3];
    for (int k = 0; k < 3; ++k) {
      const double from = (ball.centre[k] - reach - low[k]) / cell;
      first[k] = static_cast<std::size_t>(std::max(0.0, from - 1e-6));
      last[k] = std::min(count[k] - 1, static_cast<std::size_t>(from + 2 * reach / cell + 1e-6));
    }
    // The squared distance of the ball's centre from a layer of cells.
    const auto gap = [&](int k, std::size_t i) {
      const double to = low[k] + cell * static_cast<double>(i) - ball.centre[k];
      const double away = std::max({to, -to - cell, 0.0}) * (1 - 1e-9);
      return away * away;
    };
    for (std::size_t z = first[2]; z <= last[2]; ++z)
      for (std::size_t y = first[1]; y <= last[1]; ++y) {
        const double left = reach * reach - (gap(2, z) + gap(1, y));
        std::uint32_t* const row = near.data() + (z * count[1] + y) * count[0];
        for (std::size_t x = first[0]; x <= last[0]; ++x) row[x] += gap(0, x) <= left;
      }
  }
  return *std::max_element(near.begin(), near.end());
}

/// Upper bound on the number of overlapping pairs of balls at any pose: each ball of A overlaps the
/// most that one of its size can.
std::size_t most_pairs(const Balls& a, const Balls& b, double blur) {
  constexpr double kAlike = 1.25;  // ratio of radii that are treated alike
  std::vector<double> radii;
  for (const NodeBall& ball : a) radii.push_back(ball.r);
  std::sort(radii.begin(), radii.end());
  std::size_t pairs = 0;
  for (auto from = radii.begin(); from != radii.end();) {
    const auto to = std::upper_bound(from, radii.end(), kAlike * *from);
    pairs += static_cast<std::size_t>(to - from) * most_overlaps(b, *(to - 1) + blur);
    from = to;
  }
  return pairs;
}

/// The capacity for every stage of traversals. Late stages come first, since they need most.
class Capacity {
 public:
  void add_count(std::size_t pairs) { capacity_ = std::max(capacity_, pairs + kWidth); }

  void add_trees(const SphereTree& a, const SphereTree& b, const RelativePose& pose) {
    add_trees({a, b, pose}, a.top, b.top);
  }

  std::size_t value() const { return capacity_; }

 private:
  struct Trees {
    const SphereTree& a;
    const SphereTree& b;
    const RelativePose& pose;
  };

  void add_trees(const Trees& trees, int level_a, int level_b) {
    if (level_a <= 0 && level_b <= 0) return;
    --(opens_a(trees.a, level_a, trees.b, level_b, trees.pose.a_from_b.scale) ? level_a : level_b);
    add_trees(trees, level_a, level_b);
    add_stage(trees, level_a, level_b);
  }

  void add_stage(const Trees& trees, int level_a, int level_b) {
    const std::size_t count_a = trees.a.count(level_a), count_b = trees.b.count(level_b);
    const std::size_t most = count_a * count_b + kWidth;
    if (most <= capacity_) return;
    const double scale = trees.pose.a_from_b.scale;
    const double roots = trees.a.header->root[3] + scale * trees.b.header->root[3];
    // Covers the rounding of the kernels.
    const double blur = distance_error(
        precision_for(trees.a.root(), trees.b.root(), trees.pose.a_from_b.scale), 32 * roots);
    const Balls a = balls_of(trees.a, level_a, 1), b = balls_of(trees.b, level_b, scale);
    const std::size_t pairs = std::min(most_pairs(a, b, blur), most_pairs(b, a, blur));
    capacity_ = std::max(capacity_, std::min(most, pairs + kWidth));
  }

  std::size_t capacity_ = kWidth * OpenRuns::kMostVisits;
};

void need_spheres(const PlacedAsset& solid) {
  if (solid.asset.sphere_count() == 0)
    throw Error(
        "workspace_capacity: an asset without spheres is asked by its mesh: use the default "
        "capacity");
}

RelativePose valid_pose(const std::optional<RelativePose>& pose) {
  if (!pose)
    throw Error("workspace_capacity: an asset is empty, or a scale is not positive and finite");
  return *pose;
}

std::size_t capacity_of(const PlacedAsset& a, const PlacedAsset& b) {
  const PlacedAsset still_a{a.asset, {}, a.scale}, still_b{b.asset, {}, b.scale};
  const RelativePose pose = valid_pose(relative_pose(still_a, still_b));
  Capacity capacity;
  need_spheres(a);
  need_spheres(b);
  const AssetHeader &header_a = a.asset.header(), &header_b = b.asset.header();
  const auto add = [&](const TreeHeader& tree_a, const TreeHeader& tree_b) {
    capacity.add_trees({header_a, tree_a}, {header_b, tree_b}, pose);
  };
  add(header_a.inner_tree, header_b.inner_tree);
  const LevelChain chain(header_a, header_b, pose.a_from_b.scale);
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const LevelPair& pair = chain[i];
    add(matched_tree(header_a, pair.a), matched_tree(header_b, pair.b));
    if (pair.a != pair.b || !are_one_asset(header_a, header_b)) continue;
    // Copies that nearly coincide use unlike levels.
    const std::uint32_t other = pair.a < header_a.detail_count ? pair.a + 1 : pair.a - 1;
    add(matched_tree(header_a, pair.a), matched_tree(header_b, other));
    add(matched_tree(header_a, other), matched_tree(header_b, pair.a));
  }
  return capacity.value();
}

std::size_t capacity_of(const PlacedShape& a, const PlacedAsset& b) {
  valid_pose(relative_pose(Pose{}, a.scale, PlacedAsset{b.asset, {}, b.scale}));
  Capacity capacity;
  need_spheres(b);
  for (const Measure measure : {Measure::matched, Measure::inner})
    capacity.add_count(sphere_tree(b.asset, measure).count(0));
  return capacity.value();
}

}  // namespace

std::size_t workspace_capacity(const PlacedSolid& a, const PlacedSolid& b) {
  const auto* const tree_a = std::get_if<PlacedAsset>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedAsset>(&b.placed);
  if (tree_a != nullptr && tree_b != nullptr) return capacity_of(*tree_a, *tree_b);
  if (tree_b != nullptr) return capacity_of(*std::get_if<PlacedShape>(&a.placed), *tree_b);
  if (tree_a != nullptr) return capacity_of(*std::get_if<PlacedShape>(&b.placed), *tree_a);
  throw Error("workspace_capacity: no query takes two shapes");
}

}  // namespace ist
