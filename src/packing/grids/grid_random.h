#pragma once

#include <cstdint>

#include "numerics/hashing.h"

namespace ist::packing {

/// Random bits of a key, a counter-based generator: `counter`-th number of (seed, round, cell).
IST_HD inline std::uint64_t random_bits(std::uint64_t seed, std::uint32_t round, std::uint32_t cell,
                                        std::uint32_t counter) {
  const std::uint64_t key = mixed(seed + 0x9E3779B97F4A7C15ull);
  const std::uint64_t place = mixed(key ^ (std::uint64_t{round} << 32 | cell));
  return mixed(place + 0x9E3779B97F4A7C15ull * (counter + 1));
}

/// In [0, 1), of 21 bits of `bits` from `shift` on.
IST_HD inline float uniform_part(std::uint64_t bits, int shift) {
  return static_cast<float>(static_cast<std::uint32_t>(bits >> shift) & 0x1FFFFFu) * 0x1p-21f;
}

}  // namespace ist::packing
