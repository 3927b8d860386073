#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>

#include "base/host_device.h"
#include "cuda/query/tree_ref.h"

namespace ist::gpu {

/// The cover radii of an inner tree, in place like TreeRef.
struct CoverRef {
  const NodeBlock* nodes[kMaxLevels];  ///< from level 1 on
  const float* spheres;
  double root;

  /// `tree`: the header of the inner tree.
  static CoverRef of(const TreeHeader& tree, const std::byte* bytes) {
    CoverRef ref = {};
    for (std::uint32_t i = 1; i < tree.level_count; ++i)
      ref.nodes[i] = reinterpret_cast<const NodeBlock*>(bytes + tree.level[i].nodes);
    ref.spheres = reinterpret_cast<const float*>(bytes + tree.sphere_cover);
    ref.root = tree.root_cover;
    return ref;
  }

  /// The cover radii of a node's children, unit frame.
  IST_HD const float* below(int level, std::uint32_t node) const {
    return level == 0 ? spheres + std::size_t{kWidth} * node : nodes[level][node].cover;
  }

  /// The cover radius of a node. `top`: the level of the tree's root.
  IST_HD double of_node(int level, std::uint32_t node, int top) const {
    return level == top ? root
                        : static_cast<double>(below(level + 1, node / kWidth)[node % kWidth]);
  }
};

}  // namespace ist::gpu
