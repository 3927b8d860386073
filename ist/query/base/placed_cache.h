#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "numerics/bits.h"

namespace ist {

/// What was placed lately: each place holds the last thing with a number of the same remainder.
/// forget() that before its first use.
template <class T, std::uint32_t kPlaces>
struct PlacedCache {
  std::uint32_t number[kPlaces];
  T placed[kPlaces];

  void forget() noexcept { std::fill_n(number, kPlaces, kNoIndex); }

  /// The place of a number, and whether it holds what was placed with it.
  std::pair<T&, bool> find(std::uint32_t n) noexcept {
    return {placed[n % kPlaces], std::exchange(number[n % kPlaces], n) == n};
  }
};

}  // namespace ist
