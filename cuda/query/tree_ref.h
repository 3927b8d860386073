#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>

#include "query/asset/node_ball.h"

// Trees of an asset in place, in device memory or, for tests, in that of the host.

namespace ist::gpu {

/// One tree with its offsets resolved. A node is named by a level and a block of it.
struct TreeRef {
  const BallBlock* blocks[kMaxLevels];
  const Origin* origins[kMaxLevels];
  double root[4];
  /// The cube of the typical radius of nodes of level k − 1, up to a factor that all trees share.
  double cube[kMaxLevels + 1];
  std::uint32_t leaf_blocks;
  int top;  ///< the level of one block

  /// `tree`: the header in host memory. `bytes`: the address of the asset.
  static TreeRef of(const TreeHeader& tree, const std::byte* bytes) {
    TreeRef ref = {};
    ref.top = static_cast<int>(tree.level_count) - 1;
    for (int i = 0; i <= ref.top; ++i) {
      const LevelHeader& level = tree.level[i];
      ref.blocks[i] = reinterpret_cast<const BallBlock*>(bytes + level.blocks);
      ref.origins[i] = reinterpret_cast<const Origin*>(bytes + level.origins);
      ref.cube[i + 1] = typical_cube(tree.root[3], level.count);
    }
    ref.cube[0] = typical_cube(tree.root[3], tree.sphere_count);
    for (int k = 0; k < 4; ++k) ref.root[k] = tree.root[k];
    ref.leaf_blocks = tree.level[0].count;
    return ref;
  }

  /// Unit frame.
  IST_HD NodeBall ball(int level, std::uint32_t node) const {
    if (level == top) return {{root[0], root[1], root[2]}, root[3]};
    return lane_ball(blocks[level + 1][node / kWidth], origins[level + 1][node / kWidth],
                     node % kWidth);
  }
};

/// The side that each step of a traversal opens, from the roots down to leaf blocks or, for much
/// larger spheres, to single ones: the order of Descent (query/tree_overlap/descent.h).
struct OpeningSteps {
  static constexpr int kMost = 2 * kMaxLevels;
  signed char level_a[kMost + 1], level_b[kMost + 1];  ///< before the step; the last: of the leaves
  bool opens_a[kMost];
  int count;

  /// `scale`: of B in A's unit frame.
  IST_HD void plan(const TreeRef& a, const TreeRef& b, double scale) {
    int at_a = a.top, at_b = b.top;
    const auto note = [&] {
      level_a[count] = static_cast<signed char>(at_a);
      level_b[count] = static_cast<signed char>(at_b);
    };
    for (count = 0; count < kMost && (at_a > 0 || at_b > 0); ++count) {
      note();
      const bool open_a = ist::opens_a(at_a, a.cube[at_a + 1], at_b, b.cube[at_b + 1], scale);
      opens_a[count] = open_a;
      --(open_a ? at_a : at_b);
    }
    note();
  }
};

}  // namespace ist::gpu
