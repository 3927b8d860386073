#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "base/host_device.h"
#include "cuda/query/answers.h"
#include "cuda/query/cuts_ref.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/pair_memory.h"
#include "query/contact/contact_numbers.h"

// Where a team keeps what it needs for a pair's patches.

namespace ist::gpu {

/// What one bin of the divided tree has of the overlap.
struct PatchBin {
  double term[kTerms];
  double pull;    ///< |force|, as term[kForce] has it
  double before;  ///< Σ of the pulls of the bins of lower rank
};

/// Part of a contact: a region of the tree, and bins.
struct PatchPart {
  double loss;  ///< what taking it for one patch loses; the largest is divided next
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

/// A team's room in device memory, one part after another.
struct PatchRoom {
  PatchParts* parts;
  PatchBin* bin;         ///< [most_bins] by rank
  std::uint16_t* rank;   ///< [most_bins] of the bins that hold anything, in order
  std::uint8_t* member;  ///< [most_bins] the part that each of them is in

  IST_HD static constexpr std::size_t bytes(std::uint32_t most_bins) {
    const std::size_t all = sizeof(PatchParts) + most_bins * (sizeof(PatchBin) + 3);
    return (all + 255) / 256 * 256;
  }
  IST_HD static PatchRoom at(std::byte* from, std::uint32_t most_bins) {
    PatchRoom room;
    room.parts = reinterpret_cast<PatchParts*>(from);
    room.bin = reinterpret_cast<PatchBin*>(room.parts + 1);
    room.rank = reinterpret_cast<std::uint16_t*>(room.bin + most_bins);
    room.member = reinterpret_cast<std::uint8_t*>(room.rank + most_bins);
    return room;
  }
};

/// Words of a bit a bin.
IST_HD inline int words_of(const CutsRef& cuts) { return static_cast<int>((cuts.bins + 31) / 32); }

/// What a team keeps at hand.
struct PatchMemory {
  static constexpr std::uint32_t kWords = kMostContactBins / 32;

  PairMemory pair;
  std::uint32_t marked[kWords];           ///< bins that hold anything, by rank
  std::uint16_t bins_before[kWords + 1];  ///< marked bins of lower words
  float term[32][kTerms + 1];             ///< what lanes add; an odd number keeps banks apart
  int bin[32];                            ///< to which bins
};

}  // namespace ist::gpu
