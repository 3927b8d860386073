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

}  // namespace ist
