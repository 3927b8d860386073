#include "build/tree_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "build/bounding_ball.h"
#include "build/two_means.h"

namespace ist {
namespace {

constexpr double kBallVolume = 4 * std::numbers::pi / 3;

Ball to_ball(const Sphere4& s) { return {s.x, s.y, s.z, s.r}; }

/// An origin for coordinates in [low, high] such that x − origin is exact in float for every float
/// x between them: within a factor of two by Sterbenz' lemma; otherwise zero, when the coordinates
/// are no larger than twice their spread, so that zero is as near as any.
double exact_origin(float low, float high) {
  const bool same_sign = (low > 0 && high > 0) || (low < 0 && high < 0);
  const float smaller = std::fmin(std::fabs(low), std::fabs(high));
  const float larger = std::fmax(std::fabs(low), std::fabs(high));
  if (!same_sign || larger > 2 * smaller) return 0;
  return static_cast<double>(low + (high - low) / 2);
}

/// Packs float balls, sixteen to a block.
void fill_blocks(std::span<const Sphere4> balls, TreeLevelArrays& level) {
  const std::size_t count = (balls.size() + kWidth - 1) / kWidth;
  level.blocks.resize(count);
  level.origins.resize(count);
  for (std::size_t b = 0; b < count; ++b) {
    const auto used =
        balls.subspan(b * kWidth, std::min<std::size_t>(kWidth, balls.size() - b * kWidth));
    Sphere4 low = used.front();
    Sphere4 high = used.front();
    for (const Sphere4& s : used) {
      low = {std::fmin(low.x, s.x), std::fmin(low.y, s.y), std::fmin(low.z, s.z), 0};
      high = {std::fmax(high.x, s.x), std::fmax(high.y, s.y), std::fmax(high.z, s.z), 0};
    }
    const Origin origin = {exact_origin(low.x, high.x), exact_origin(low.y, high.y),
                           exact_origin(low.z, high.z)};
    BallBlock& block = level.blocks[b];
    block = {};
    std::fill(std::begin(block.r), std::end(block.r), kEmptyRadius);
    for (std::size_t l = 0; l < used.size(); ++l) {
      block.x[l] = static_cast<float>(used[l].x - origin.x);
      block.y[l] = static_cast<float>(used[l].y - origin.y);
      block.z[l] = static_cast<float>(used[l].z - origin.z);
      block.r[l] = used[l].r;
    }
    level.origins[b] = origin;
  }
}

/// A float ball around spheres; the centre is rounded first, the radius about it rounded up.
Sphere4 ball_around(std::span<const Ball> spheres) {
  const Ball ball = bounding_ball(spheres);
  Sphere4 out = {static_cast<float>(ball.x), static_cast<float>(ball.y), static_cast<float>(ball.z),
                 0};
  double radius = 0;
  for (const Ball& s : spheres) radius = std::fmax(radius, reach(out.x, out.y, out.z, s));
  out.r = round_up(radius);
  return out;
}

float cover_about(const Sphere4& centre, std::span<const Ball> spheres,
                  std::span<const float> covers) {
  double radius = 0;
  for (std::size_t i = 0; i < covers.size(); ++i)
    radius = std::fmax(radius, reach(centre.x, centre.y, centre.z,
                                     {spheres[i].x, spheres[i].y, spheres[i].z, covers[i]}));
  return round_up(radius);
}

double volume_of(std::span<const Ball> spheres) {
  double sum = 0;
  for (const Ball& s : spheres) sum += kBallVolume * (s.r * s.r * s.r);
  return sum;
}

}  // namespace

TreeArrays tree_from_order(std::span<const Sphere4> spheres, std::span<const float> covers,
                           std::vector<std::uint32_t> order) {
  const std::size_t n = spheres.size();
  TreeArrays tree;
  std::vector<Sphere4> lanes(n);
  std::vector<Ball> sorted(n);
  std::vector<float> sorted_covers(covers.size());
  for (std::size_t i = 0; i < n; ++i) {
    lanes[i] = spheres[order[i]];
    sorted[i] = to_ball(lanes[i]);
    if (!covers.empty()) sorted_covers[i] = covers[order[i]];
  }
  tree.levels.emplace_back();
  fill_blocks(lanes, tree.levels.back());

  const std::size_t padded = tree.levels.back().blocks.size() * kWidth;
  order.resize(padded, 0);
  tree.sphere_index = std::move(order);
  if (!covers.empty()) {
    tree.sphere_cover = sorted_covers;
    tree.sphere_cover.resize(padded, kEmptyRadius);
  }

  for (std::size_t span = kWidth; tree.levels.back().blocks.size() > 1; span *= kWidth) {
    const std::size_t count = tree.levels.back().blocks.size();
    TreeLevelArrays level;
    level.nodes.resize((count + kWidth - 1) / kWidth);
    for (NodeBlock& nodes : level.nodes) {
      nodes = {};
      if (!covers.empty()) std::fill(std::begin(nodes.cover), std::end(nodes.cover), kEmptyRadius);
    }
    std::vector<Sphere4> balls(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t begin = i * span;
      const std::size_t size = std::min(span, n - begin);
      const auto below = std::span<const Ball>(sorted).subspan(begin, size);
      balls[i] = ball_around(below);
      NodeBlock& nodes = level.nodes[i / kWidth];
      nodes.volume[i % kWidth] = round_up(volume_of(below));
      if (!covers.empty())
        nodes.cover[i % kWidth] = cover_about(
            balls[i], below, std::span<const float>(sorted_covers).subspan(begin, size));
      nodes.overlap[i % kWidth] = covers.empty() ? static_cast<float>(size) : 1;
    }
    fill_blocks(balls, level);
    tree.levels.push_back(std::move(level));
  }

  const Sphere4 root = ball_around(sorted);
  tree.root[0] = root.x;
  tree.root[1] = root.y;
  tree.root[2] = root.z;
  tree.root[3] = root.r;
  if (!covers.empty()) tree.root_cover = cover_about(root, sorted, sorted_covers);
  for (const Sphere4& s : spheres) tree.volume_sum += volume_of(std::array{to_ball(s)});
  tree.overlap = covers.empty() ? static_cast<float>(n) : 1;
  return tree;
}

TreeArrays build_tree(std::span<const Sphere4> spheres, std::span<const float> covers) {
  std::vector<Ball> balls;
  balls.reserve(spheres.size());
  for (const Sphere4& s : spheres) balls.push_back(to_ball(s));
  return tree_from_order(spheres, covers, two_means_order(balls, false));
}

}  // namespace ist
