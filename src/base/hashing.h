#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/vec3.h"

// Names that do not depend on the order of work: hashes of the bits of coordinates.

namespace ist {

IST_HD inline std::uint64_t mixed(std::uint64_t x) {  // the finaliser of SplitMix64
  x ^= x >> 30;
  x *= 0xBF58476D1CE4E5B9ull;
  x ^= x >> 27;
  x *= 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// The lowest 21 bits, each followed by two zeros, for codes of Morton's curve.
inline std::uint64_t spread_bits(std::uint64_t v) {
  v = (v | v << 32) & 0x001f00000000ffffu;
  v = (v | v << 16) & 0x001f0000ff0000ffu;
  v = (v | v << 8) & 0x100f00f00f00f00fu;
  v = (v | v << 4) & 0x10c30c30c30c30c3u;
  return (v | v << 2) & 0x1249249249249249u;
}

IST_HD inline std::uint32_t point_hash(Float3 point, std::uint64_t seed) {
  std::uint64_t hash = mixed(seed + 0x9E3779B97F4A7C15ull);
  hash = mixed(hash ^ (bits_of(point.x) | std::uint64_t{bits_of(point.y)} << 32));
  hash = mixed(hash ^ bits_of(point.z));
  return static_cast<std::uint32_t>(hash >> 32);
}

}  // namespace ist
