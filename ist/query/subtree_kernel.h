#pragma once

#include <cstdint>

#include "query/sphere_tree.h"

namespace ist {

/// All spheres below a node, in its tree's unit frame.
struct SubtreeSums {
  double volume = 0;
  double moment[3] = {};  ///< Σ volume · centre
  std::uint32_t spheres = 0;
};

/// Adds up the spheres below a node, to rounding in double. Same bits on every instruction set.
SubtreeSums subtree_sums(const SphereTree& tree, int level, std::uint32_t block) noexcept;

}  // namespace ist
