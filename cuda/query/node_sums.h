#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/query/tree_ref.h"
#include "numerics/host_device.h"

// What the spheres below each node of a tree add up to: a node that lies in a field as a whole is
// one look then.

namespace ist::gpu {

/// Of the spheres below a node, their tree's unit frame.
struct NodeSum {
  double cubes;      ///< Σ r³
  double moment[3];  ///< Σ r³ · centre
};

/// The sums of a tree where they lie.
struct SumsRef {
  const NodeSum* level[kMaxLevels];  ///< [nodes of the level]
  std::uint32_t sphere_count;

  /// `sums`: as node_sums() made them.
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

inline std::size_t node_count(const TreeHeader& tree) {
  std::size_t count = 0;
  for (std::uint32_t k = 0; k < tree.level_count; ++k) count += tree.level[k].count;
  return count;
}

/// Of all nodes, level by level. `bytes`: of the asset, which the host reads.
inline std::vector<NodeSum> node_sums(const TreeHeader& tree, const std::byte* bytes) {
  std::vector<NodeSum> sums;
  sums.reserve(node_count(tree));
  const LevelHeader& leaves = tree.level[0];
  const auto* const blocks = reinterpret_cast<const BallBlock*>(bytes + leaves.blocks);
  const auto* const origins = reinterpret_cast<const Origin*>(bytes + leaves.origins);
  for (std::uint32_t i = 0; i < leaves.count; ++i) {
    NodeSum sum = {};
    for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
      const auto r = static_cast<double>(blocks[i].r[lane]);
      if (!(r > 0)) continue;
      const double cube = r * r * r;
      sum.cubes += cube;
      sum.moment[0] += cube * (origins[i].x + static_cast<double>(blocks[i].x[lane]));
      sum.moment[1] += cube * (origins[i].y + static_cast<double>(blocks[i].y[lane]));
      sum.moment[2] += cube * (origins[i].z + static_cast<double>(blocks[i].z[lane]));
    }
    sums.push_back(sum);
  }
  std::size_t below = 0;
  for (std::uint32_t k = 1; k < tree.level_count; ++k) {
    const std::size_t children = tree.level[k - 1].count;
    for (std::size_t i = 0; i < tree.level[k].count; ++i) {
      NodeSum sum = {};
      for (std::size_t c = kWidth * i; c < std::min(children, kWidth * (i + 1)); ++c) {
        sum.cubes += sums[below + c].cubes;
        for (int axis = 0; axis < 3; ++axis) sum.moment[axis] += sums[below + c].moment[axis];
      }
      sums.push_back(sum);
    }
    below += children;
  }
  return sums;
}

}  // namespace ist::gpu
