#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "base/bits.h"

namespace ist {

/// A direct-mapped cache of placed blocks. Call forget() before the first use.
template <class T, std::uint32_t kPlaces>
struct PlacedCache {
  std::uint32_t number[kPlaces];
  T placed[kPlaces];

  void forget() noexcept { std::fill_n(number, kPlaces, kNoIndex); }

  /// The slot of block n, and whether it contains that block.
  std::pair<T&, bool> find(std::uint32_t n) noexcept {
    return {placed[n % kPlaces], std::exchange(number[n % kPlaces], n) == n};
  }
};

}  // namespace ist
