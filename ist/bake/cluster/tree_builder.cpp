#include "bake/cluster/tree_builder.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/elementary.h"
#include "base/vec3.h"

namespace ist {
namespace {

Ball to_ball(const Sphere& s) { return {s.x, s.y, s.z, s.r}; }

std::vector<Ball> to_balls(std::span<const Sphere> spheres) {
  std::vector<Ball> balls;
  balls.reserve(spheres.size());
  for (const Sphere& s : spheres) balls.push_back(to_ball(s));
  return balls;
}

/// An origin for coordinates in [low, high] such that x − origin is exact in float for every float
/// x between them: within a factor of two by Sterbenz' lemma; otherwise zero, as then the
/// coordinates are no larger than twice their spread, so that zero is near enough.
double exact_origin(float low, float high) {
  const bool same_sign = (low > 0 && high > 0) || (low < 0 && high < 0);
  const float smaller = std::fmin(std::fabs(low), std::fabs(high));
  const float larger = std::fmax(std::fabs(low), std::fabs(high));
  if (!same_sign || larger > 2 * smaller) return 0;
  return static_cast<double>(low + (high - low) / 2);
}

/// Packs float balls, sixteen to a block; origin + offset is exactly every centre.
void fill_blocks(std::span<const Sphere> balls, std::vector<BallBlock>& blocks,
                 std::vector<Origin>& origins) {
  const std::size_t count = (balls.size() + kWidth - 1) / kWidth;
  blocks.resize(count);
  origins.resize(count);
  for (std::size_t b = 0; b < count; ++b) {
    const auto used =
        balls.subspan(b * kWidth, std::min<std::size_t>(kWidth, balls.size() - b * kWidth));
    Sphere low = used.front();
    Sphere high = used.front();
    for (const Sphere& s : used) {
      low = {std::fmin(low.x, s.x), std::fmin(low.y, s.y), std::fmin(low.z, s.z), 0};
      high = {std::fmax(high.x, s.x), std::fmax(high.y, s.y), std::fmax(high.z, s.z), 0};
    }
    const Origin origin = {exact_origin(low.x, high.x), exact_origin(low.y, high.y),
                           exact_origin(low.z, high.z)};
    BallBlock& block = blocks[b];
    block = {};
    std::fill(std::begin(block.r), std::end(block.r), kEmptyRadius);
    for (std::size_t l = 0; l < used.size(); ++l) {
      block.x[l] = static_cast<float>(used[l].x - origin.x);
      block.y[l] = static_cast<float>(used[l].y - origin.y);
      block.z[l] = static_cast<float>(used[l].z - origin.z);
      block.r[l] = used[l].r;
    }
    origins[b] = origin;
  }
}

/// A float ball around balls; the centre is rounded first, then the radius about it is rounded up.
Sphere ball_around(std::span<const Ball> balls) {
  const Ball ball = bounding_ball(balls);
  Sphere out = {static_cast<float>(ball.x), static_cast<float>(ball.y), static_cast<float>(ball.z),
                0};
  double radius = 0;
  for (const Ball& b : balls) radius = std::fmax(radius, reach(out.x, out.y, out.z, b));
  out.r = padded_up(radius);
  return out;
}

float cover_about(const Sphere& centre, std::span<const Ball> spheres,
                  std::span<const float> covers) {
  double radius = 0;
  for (std::size_t i = 0; i < covers.size(); ++i)
    radius = std::fmax(radius, reach(centre.x, centre.y, centre.z,
                                     {spheres[i].x, spheres[i].y, spheres[i].z, covers[i]}));
  return padded_up(radius);
}

double volume_of(std::span<const Ball> spheres) {
  double sum = 0;
  for (const Ball& s : spheres) sum += ball_volume(s.r);
  return sum;
}

/// Balls around each 16^(k+1) consecutive spheres, for every level up to one of a single block.
std::vector<std::vector<Sphere>> level_balls(std::span<const Ball> sorted) {
  std::vector<std::vector<Sphere>> levels;
  for (std::size_t span = kWidth; span < sorted.size(); span *= kWidth) {
    std::vector<Sphere>& balls = levels.emplace_back((sorted.size() + span - 1) / span);
    tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
      balls[i] = ball_around(sorted.subspan(i * span, std::min(span, sorted.size() - i * span)));
    });
  }
  return levels;
}

/// κ of every level's nodes and, last, of the whole tree; 1 for disjoint spheres.
std::vector<std::vector<float>> overlaps(std::span<const Ball> sorted,
                                         const std::vector<std::vector<Sphere>>& levels,
                                         bool disjoint) {
  std::vector<std::vector<Ball>> balls;
  balls.reserve(levels.size());
  for (const auto& level : levels) balls.push_back(to_balls(level));
  if (!disjoint) return overlap_bounds(sorted, balls);
  std::vector<std::vector<float>> kappa;
  kappa.reserve(levels.size() + 1);
  for (const auto& level : levels) kappa.emplace_back(level.size(), 1.0f);
  kappa.push_back({1.0f});
  return kappa;
}

}  // namespace

TreeArrays tree_from_order(std::span<const Sphere> spheres, std::span<const float> covers,
                           std::vector<std::uint32_t> order) {
  const std::size_t n = spheres.size();
  std::vector<Sphere> lanes(n);
  std::vector<Ball> sorted(n);
  std::vector<float> sorted_covers(covers.size());
  for (std::size_t i = 0; i < n; ++i) {
    lanes[i] = spheres[order[i]];
    sorted[i] = to_ball(lanes[i]);
    if (!covers.empty()) sorted_covers[i] = covers[order[i]];
  }

  TreeArrays tree;
  TreeLevelArrays& leaves = tree.levels.emplace_back();
  fill_blocks(lanes, leaves.blocks, leaves.origins);
  const std::size_t padded = tree.levels.back().blocks.size() * kWidth;
  order.resize(padded, 0);
  tree.sphere_index = std::move(order);
  if (!covers.empty()) {
    tree.sphere_cover = sorted_covers;
    tree.sphere_cover.resize(padded, kEmptyRadius);
  }

  const auto levels = level_balls(sorted);
  const auto kappa = overlaps(sorted, levels, !covers.empty());
  std::size_t span = kWidth;
  for (std::size_t k = 0; k < levels.size(); ++k, span *= kWidth) {
    TreeLevelArrays& level = tree.levels.emplace_back();
    fill_blocks(levels[k], level.blocks, level.origins);
    level.nodes.resize(level.blocks.size());
    if (!covers.empty())
      for (NodeBlock& nodes : level.nodes)
        std::fill(std::begin(nodes.cover), std::end(nodes.cover), kEmptyRadius);
    for (std::size_t i = 0; i < levels[k].size(); ++i) {
      const std::size_t begin = i * span;
      const std::size_t size = std::min(span, n - begin);
      const auto below = std::span<const Ball>(sorted).subspan(begin, size);
      NodeBlock& nodes = level.nodes[i / kWidth];
      const std::size_t lane = i % kWidth;
      nodes.volume[lane] = padded_up(volume_of(below));
      nodes.overlap[lane] = kappa[k][i];
      if (!covers.empty())
        nodes.cover[lane] = cover_about(levels[k][i], below,
                                        std::span<const float>(sorted_covers).subspan(begin, size));
    }
  }

  const Sphere root = ball_around(sorted);
  tree.root[0] = root.x;
  tree.root[1] = root.y;
  tree.root[2] = root.z;
  tree.root[3] = root.r;
  if (!covers.empty()) tree.root_cover = cover_about(root, sorted, sorted_covers);
  for (const Sphere& s : spheres) tree.volume_sum += volume_of(std::array{to_ball(s)});
  tree.mean_radius = cube_root(tree.volume_sum / static_cast<double>(n) * 0.75 / std::numbers::pi);
  tree.overlap = kappa.back().front();
  return tree;
}

std::vector<std::uint32_t> sphere_order(std::span<const Sphere> spheres, bool swaps) {
  return tree_order(to_balls(spheres), swaps);
}

TreeArrays build_tree(std::span<const Sphere> spheres, std::span<const float> covers, bool swaps) {
  return tree_from_order(spheres, covers, sphere_order(spheres, swaps));
}

TreeArrays build_tree_like(std::span<const Sphere> spheres, std::vector<std::uint32_t> order) {
  return tree_from_order(spheres, {}, refined_order(to_balls(spheres), std::move(order)));
}

}  // namespace ist
