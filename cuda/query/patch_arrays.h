#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/patch_memory.h"

namespace ist::gpu {

/// A batch of contact patches in the memory of who works on it.
struct PatchArrays {
  BatchArrays pairs;  ///< solids, pairs, answers, counters and the list
  GpuContactPatches patches;
  std::byte* rooms;         ///< of teams, one after another
  std::uint32_t most_bins;  ///< of any asset

  IST_HD PatchRoom room(std::uint32_t team) const {
    return PatchRoom::at(rooms + team * PatchRoom::bytes(most_bins), most_bins);
  }
};

}  // namespace ist::gpu
