#pragma once

#include <cstddef>
#include <cstdint>

#include "query/kernel/leaf_kernel.h"

namespace ist {

/// Adds what each pair of leaf blocks would hold if their spheres filled the blocks' balls evenly:
/// a smooth function of the pose, in a fifth of the time of the pairs' lenses. Where one side is a
/// single sphere that is its own ball. Budget and bins of the stage are not looked at.
void guess_leaf_pairs(const LeafStage& stage, const std::uint32_t* a, const std::uint32_t* b,
                      std::size_t n, LeafSums& sums) noexcept;

}  // namespace ist
