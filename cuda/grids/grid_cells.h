#pragma once

// Device code only: how the kernels of the distance grid find a cell's word.

#include "packing/grids/distance_grid.h"

namespace ist::gpu {

/// The words of a distance grid, to be changed.
struct GridWords {
  std::uint32_t* words = nullptr;
  const std::uint32_t* keys = nullptr;  ///< nullptr: not hashed
  std::uint32_t key_mask = 0;

  /// nullptr if the cell is not active.
  __device__ std::uint32_t* find(std::uint32_t cell) const {
    using packing::DistanceGrid;
    std::uint32_t at = cell;
    if (keys != nullptr) {
      at = DistanceGrid::hashed(cell) & key_mask;
      while (keys[at] != cell) {
        if (keys[at] == DistanceGrid::kEmptyKey) return nullptr;
        at = (at + 1) & key_mask;
      }
    }
    return words[at] == DistanceGrid::kInactive ? nullptr : words + at;
  }
};

}  // namespace ist::gpu
