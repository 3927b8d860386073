#pragma once

#include <algorithm>
#include <cstdint>

#include <ist/query.h>

#include <ist/asset_layout.h>

#include "base/vec3.h"
#include "query/asset/node_ball.h"

namespace ist {

/// Sums over all spheres below a block.
struct NodeSums {
  double volume = 0;   ///< Σ of sphere volumes, rounded up
  double overlap = 1;  ///< κ: no point lies in more spheres than this
};

/// The ball around the sixteen balls (spheres at level 0) of a block of a tree.
struct TreeNode {
  int level;
  std::uint32_t block;
};

/// One tree of an asset with its offsets resolved.
struct SphereTree {
  struct Level {
    const BallBlock* blocks = nullptr;
    const Origin* origins = nullptr;
    const NodeBlock* nodes = nullptr;
    std::uint32_t count = 0;
  };

  SphereTree(const AssetHeader& asset, const TreeHeader& tree) noexcept
      : header(&tree),
        top(static_cast<int>(tree.level_count) - 1),
        sphere_cover(tree.sphere_cover != 0 ? at<float>(asset, tree.sphere_cover) : nullptr) {
    for (int i = 0; i <= top; ++i) {
      const LevelHeader& from = tree.level[i];
      level[i] = {at<BallBlock>(asset, from.blocks), at<Origin>(asset, from.origins),
                  at<NodeBlock>(asset, from.nodes), from.count};
    }
  }

  /// Unit frame, at full precision.
  NodeBall ball(TreeNode node) const noexcept { return ball(node.level, node.block); }
  NodeBall ball(int at_level, std::uint32_t block) const noexcept {
    if (at_level == top)
      return {{header->root[0], header->root[1], header->root[2]}, header->root[3]};
    const Level& above = level[at_level + 1];
    return lane_ball(above.blocks[block / kWidth], above.origins[block / kWidth], block % kWidth);
  }

  RootBall root() const noexcept { return RootBall::of(header->root, header->root_cover); }

  NodeBall sphere(std::uint32_t block, std::uint32_t lane) const noexcept {
    return lane_ball(level[0].blocks[block], level[0].origins[block], lane);
  }

  NodeSums sums(int at_level, std::uint32_t block) const noexcept {
    if (at_level == kSphereLevel) return {ball_volume(ball(at_level, block).r), 1};
    if (at_level == top) return {header->volume_sum, static_cast<double>(header->overlap)};
    const NodeBlock& n = level[at_level + 1].nodes[block / kWidth];
    const std::uint32_t lane = block % kWidth;
    return {static_cast<double>(n.volume[lane]), static_cast<double>(n.overlap[lane])};
  }

  /// Inner tree: the radius about the node's centre that contains every cover ball below it.
  double cover(int at_level, std::uint32_t block) const noexcept {
    if (at_level == top) return header->root_cover;
    return static_cast<double>(level[at_level + 1].nodes[block / kWidth].cover[block % kWidth]);
  }

  double typical_cube(int at_level) const noexcept {
    return ist::typical_cube(header->root[3], count(at_level));
  }

  /// The leaf blocks [begin, end) below a node.
  struct Leaves {
    std::uint32_t begin, end;
  };
  Leaves leaves_below(int at_level, std::uint32_t block) const noexcept {
    const std::uint64_t full = std::uint64_t{1} << (4 * at_level);
    const std::uint64_t all = level[0].count;
    return {static_cast<std::uint32_t>(std::min(all, full * block)),
            static_cast<std::uint32_t>(std::min(all, full * (block + 1)))};
  }

  /// The number of nodes of a level.
  std::uint32_t count(int at_level) const noexcept {
    return at_level == kSphereLevel ? header->sphere_count : level[at_level].count;
  }

  const TreeHeader* header;
  int top;  ///< the level of one block
  Level level[kMaxLevels];
  const float* sphere_cover;  ///< inner tree: cover radii by lanes of level 0
};

inline SphereTree sphere_tree(const AssetView& view, Measure measure) noexcept {
  const AssetHeader& asset = view.header();
  return SphereTree(asset, measure == Measure::inner ? asset.inner_tree : asset.matched_tree);
}

}  // namespace ist
