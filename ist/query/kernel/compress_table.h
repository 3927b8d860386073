#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace ist {

/// Row m: the set bits of m, lowest first, then zeros.
inline constexpr auto kSetBits = [] {
  std::array<std::array<std::uint8_t, 8>, 256> rows{};
  for (std::size_t m = 0; m < 256; ++m) {
    std::size_t count = 0;
    for (std::uint8_t bit = 0; bit < 8; ++bit)
      if ((m >> bit & 1) != 0) rows[m][count++] = bit;
  }
  return rows;
}();

/// From entry 16 − n on: n zeros, then the lane numbers. Highway's Iota is slower than a load.
alignas(64) inline constexpr std::uint32_t kLateLanes[32] = {0, 0, 0, 0, 0,  0,  0,  0,  0,  0, 0,
                                                             0, 0, 0, 0, 0,  0,  1,  2,  3,  4, 5,
                                                             6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
inline constexpr const std::uint32_t* kLaneNumbers = kLateLanes + 16;

}  // namespace ist
