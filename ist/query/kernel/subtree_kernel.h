#pragma once

#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"

namespace ist {

/// Running sums over spheres, in their tree's unit frame, by lanes. Without factors of π.
struct alignas(64) SubtreeSums {
  double cubes[kWidth] = {};      ///< Σ r³
  double moment[3][kWidth] = {};  ///< Σ r³ · centre
  std::uint32_t spheres = 0;
};

/// Adds the spheres below n nodes of a level, in order. Same bits on every instruction set.
void add_subtrees(const SphereTree& tree, int level, const std::uint32_t* nodes, std::size_t n,
                  SubtreeSums& sums) noexcept;

}  // namespace ist
