#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>
#include "query/base/placed_cache.h"
#include "query/base/precision.h"

namespace ist {

/// Sixteen spheres in A's axes, relative to an origin of their own. A lane without a sphere is a
/// point too far away to meet anything.
template <class T>
struct alignas(64) Spheres {
  T x[kWidth], y[kWidth], z[kWidth], r[kWidth];
};

/// A leaf block of either tree in A's unit frame. Four numbers, since vectors have so many.
template <class T>
struct alignas(64) PlacedBlock {
  double origin[4];  ///< of the spheres' coordinates
  double centre[4];  ///< of the leaf ball
  T lever[4];        ///< from B's origin to this one
  T radius;          ///< of the leaf ball
  T error;           ///< what the block adds to the rounding of a distance
  const Spheres<T>* spheres;
  Spheres<T> room;  ///< for those that do not lie in the asset as they are needed
};

/// Recently placed leaf blocks of one tree: each is paired with several of the other tree.
template <class T>
struct BlockCache : PlacedCache<PlacedBlock<T>, 256> {
  /// The block, which `place(block, placed)` makes if it is not cached; null if its slot is in use
  /// by one of the `held` blocks.
  template <class Place>
  const PlacedBlock<T>* find(std::uint32_t block, const PlacedBlock<T>* const* held,
                             std::size_t count, const Place& place) {
    const std::uint32_t slot = block % 256;
    std::uint32_t& number = this->number[slot];
    PlacedBlock<T>& placed = this->placed[slot];
    if (number != block) {
      if (number != kNoIndex && std::find(held, held + count, &placed) != held + count)
        return nullptr;
      number = block;
      place(block, placed);
    }
    return &placed;
  }
};

/// The leaf blocks of both trees.
template <class T>
struct PlacedBlocks {
  BlockCache<T> a, b;
};

/// In either precision; forget() that before its first use, and for other trees or another pose.
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
