#pragma once

#include <ist/gpu.h>
#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/answers.h"
#include "cuda/query/batch_arrays.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/pair_memory.h"
#include "cuda/query/solid_ref.h"
#include "query/contact/contact_numbers.h"

// A team's memory for a pair's patches.

namespace ist::gpu {

/// The share of the overlap in one bin of the divided tree.
struct PatchBin {
  double term[kTerms];
  double pull;    ///< |force|, as in term[kForce]
  double before;  ///< Σ of the pulls of the bins of lower rank
};

/// A part of a contact: a region of the tree, and its bins.
struct PatchPart {
  double loss;  ///< the loss of treating it as one patch; the part with the largest is divided next
  double pull;
  double term[kTerms];
  WorldSums world;
  std::uint32_t node;  ///< of CutsRef
  std::uint32_t bins;
};

struct PatchParts {
  PatchPart part[kMostGpuPatches];
  WorldSums whole;
  std::uint32_t order[kMostGpuPatches];  ///< by id
};

/// A team's device memory, one array after another.
struct PatchWorkspace {
  PatchParts* parts;
  PatchBin* bin;         ///< [most_bins] by rank
  std::uint16_t* rank;   ///< [most_bins] of the bins that are not empty, in order
  std::uint8_t* member;  ///< [most_bins] the part that contains each of them

  IST_HD static constexpr std::size_t bytes(std::uint32_t most_bins) {
    const std::size_t all = sizeof(PatchParts) + most_bins * (sizeof(PatchBin) + 3);
    return (all + 255) / 256 * 256;
  }
  IST_HD static PatchWorkspace at(std::byte* from, std::uint32_t most_bins) {
    PatchWorkspace work;
    work.parts = reinterpret_cast<PatchParts*>(from);
    work.bin = reinterpret_cast<PatchBin*>(work.parts + 1);
    work.rank = reinterpret_cast<std::uint16_t*>(work.bin + most_bins);
    work.member = reinterpret_cast<std::uint8_t*>(work.rank + most_bins);
    return work;
  }
};

/// The number of words with a bit for each bin.
IST_HD inline int words_of(const CutsRef& cuts) { return static_cast<int>((cuts.bins + 31) / 32); }

/// A team's fast memory.
struct PatchMemory {
  static constexpr std::uint32_t kWords = kMostContactBins / 32;

  PairMemory pair;
  std::uint32_t marked[kWords];           ///< bins that are not empty, by rank
  std::uint16_t bins_before[kWords + 1];  ///< marked bins of lower words
  float term[32][kTerms + 1];  ///< the terms of lanes; an odd number avoids bank conflicts
  int bin[32];                 ///< the bins to which they are added
};

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
