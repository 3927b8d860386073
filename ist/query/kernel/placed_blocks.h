#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>
#include "query/base/hooked_memory.h"
#include "query/base/precision.h"

namespace ist {

/// Sixteen spheres in A's axes, relative to their own origin. Unused lanes are points far away.
template <class T>
struct alignas(64) Spheres {
  T x[kWidth], y[kWidth], z[kWidth], r[kWidth];
};

/// A leaf block of either tree in A's unit frame. Vectors have a fourth component for SIMD loads.
template <class T>
struct alignas(64) PlacedBlock {
  double origin[4];  ///< of the spheres' coordinates
  double centre[4];  ///< of the leaf ball
  T lever[4];        ///< from B's origin to this one
  T radius;          ///< of the leaf ball
  T error;           ///< the block's part in the rounding of a distance
  const Spheres<T>* spheres;
  Spheres<T> own;  ///< for blocks that the asset does not store in this form
};

/// A cache of placed leaf blocks of one tree: each is paired with several blocks of the other.
template <class T>
struct BlockCache : PlacedCache<PlacedBlock<T>, 256> {
  /// The block, placed by `place(block, placed)` if it is not cached; null if one of the `in_use`
  /// blocks uses its slot.
  template <class Place>
  const PlacedBlock<T>* find(std::uint32_t block, const PlacedBlock<T>* const* in_use,
                             std::size_t count, const Place& place) {
    const std::uint32_t slot = block % 256;
    std::uint32_t& number = this->number[slot];
    PlacedBlock<T>& placed = this->placed[slot];
    if (number != block) {
      if (number != kNoIndex && std::find(in_use, in_use + count, &placed) != in_use + count)
        return nullptr;
      number = block;
      place(block, placed);
    }
    return &placed;
  }
};

template <class T>
struct PlacedBlocks {
  BlockCache<T> a, b;
};

/// Call forget() before the first use of a precision, and for other trees or another pose.
struct LeafScratch {
  PlacedBlocks<float> float32;
  PlacedBlocks<double> float64;

  void forget(Precision precision) noexcept {
    if (precision == Precision::float32) {
      float32.a.forget(), float32.b.forget();
    } else {
      float64.a.forget(), float64.b.forget();
    }
  }
};

}  // namespace ist
