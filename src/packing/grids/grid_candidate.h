#pragma once

#include "base/hashing.h"
#include "base/host_device.h"
#include "base/vec3.h"

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

/// A converged prototype: the best point found in its cell. radius ≤ 0: none.
struct GridCandidate {
  Float3 centre;
  float radius = 0;
  std::uint64_t key = 0;      ///< radius bits, then a hash of the cell
  std::uint32_t cell = 0;     ///< of the prototype grid
  std::int32_t contacts = 0;  ///< estimated number of features that it lies between
};

IST_HD inline std::uint64_t grid_key(float radius, std::uint64_t seed, std::uint32_t round,
                                     std::uint32_t cell) {
  // Positive floats are ordered like their bits.
  return std::uint64_t{bits_of(radius)} << 32 | random_bits(seed, round, cell, 0xFFFFu) >> 32;
}

/// The order of candidates of one round: larger ones first. Total, for different cells.
IST_HD inline bool goes_before(const GridCandidate& a, const GridCandidate& b) {
  return a.key != b.key ? a.key > b.key : a.cell < b.cell;
}

/// True if they overlap, or are closer than certified spheres may be (certificate.h).
IST_HD inline bool overlap(const GridCandidate& a, const GridCandidate& b) {
  constexpr double kMoreThanGap = 4e-12;
  const double x = double{a.centre.x} - double{b.centre.x};
  const double y = double{a.centre.y} - double{b.centre.y};
  const double z = double{a.centre.z} - double{b.centre.z};
  const double r = double{a.radius} + double{b.radius} + kMoreThanGap;
  return x * x + y * y + z * z < r * r;
}

}  // namespace ist::packing
