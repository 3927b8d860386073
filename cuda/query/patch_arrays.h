#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/patch_memory.h"

namespace ist::gpu {

/// A batch of contact patches, with its working memory.
struct PatchArrays {
  BatchArrays pairs;  ///< solids, pairs, answers, counters and the list
  GpuContactPatches patches;
  std::byte* team_memory;   ///< of the teams, one after another
  std::uint32_t most_bins;  ///< of any asset

  IST_HD PatchWorkspace workspace(std::uint32_t team) const {
    return PatchWorkspace::at(team_memory + team * PatchWorkspace::bytes(most_bins), most_bins);
  }
};

}  // namespace ist::gpu
