#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/tree_ref.h"

// Sums over the spheres below each node of a tree, so that a node inside a field as a whole takes
// one step.

namespace ist::gpu {

/// The sums over the spheres below a node, their tree's unit frame.
struct NodeSum {
  double cubes;      ///< Σ r³
  double moment[3];  ///< Σ r³ · centre
};

/// The sums of a tree, in place.
struct SumsRef {
  const NodeSum* level[kMaxLevels];  ///< [nodes of the level]
  std::uint32_t sphere_count;

  /// `sums`: those of node_sums().
  static SumsRef of(const TreeHeader& tree, const NodeSum* sums) {
    SumsRef ref = {};
    ref.sphere_count = tree.sphere_count;
    for (std::uint32_t k = 0; k < tree.level_count; ++k) {
      ref.level[k] = sums;
      sums += tree.level[k].count;
    }
    return ref;
  }

  IST_HD std::uint32_t spheres_below(int at_level, std::uint32_t node) const {
    const std::uint64_t full = std::uint64_t{kWidth} << (4 * at_level);
    const std::uint64_t begin = full * node, end = begin + full;
    return static_cast<std::uint32_t>((end < sphere_count ? end : sphere_count) - begin);
  }
};

}  // namespace ist::gpu
