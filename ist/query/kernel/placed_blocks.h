#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>
#include "query/base/precision.h"

namespace ist {

/// Sixteen spheres in A's axes, relative to an origin of their own. A lane without a sphere is a
/// point too far away to meet anything.
template <class T>
struct alignas(64) Spheres {
  T x[kWidth], y[kWidth], z[kWidth], r[kWidth];
};

/// A leaf block of either tree in A's unit frame. Four numbers, since vectors hold so many.
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

/// The leaf blocks of one tree that a query met lately: each meets several of the other tree.
template <class T>
class BlockCache {
 public:
  void forget() noexcept { std::fill_n(block_, kSlots, kNone); }

  /// The block, which `place(block, placed)` makes if it is not there; null if its room is that of
  /// one of the `held` blocks.
  template <class Place>
  const PlacedBlock<T>* find(std::uint32_t block, const PlacedBlock<T>* const* held,
                             std::size_t count, const Place& place) {
    const std::uint32_t slot = block % kSlots;
    PlacedBlock<T>& placed = placed_[slot];
    if (block_[slot] != block) {
      if (block_[slot] != kNone && std::find(held, held + count, &placed) != held + count)
        return nullptr;
      block_[slot] = block;
      place(block, placed);
    }
    return &placed;
  }

 private:
  static constexpr std::uint32_t kSlots = 256;
  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t block_[kSlots];
  PlacedBlock<T> placed_[kSlots];
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
