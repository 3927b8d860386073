#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "base/host_device.h"

namespace ist {

inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;  ///< marks a missing index

IST_HD inline std::uint32_t bits_of(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

IST_HD inline float float_of(std::uint32_t bits) {
  float x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// Maps a float to an integer of the same order.
IST_HD inline std::uint32_t ordered_bits(float x) {
  const std::uint32_t bits = bits_of(x);
  return bits ^ ((bits >> 31) != 0 ? 0xFFFFFFFFu : 0x80000000u);
}

IST_HD inline float from_ordered_bits(std::uint32_t ordered) {
  return float_of(ordered ^ ((ordered >> 31) != 0 ? 0x80000000u : 0xFFFFFFFFu));
}

/// Maps a double to an integer of the same order.
IST_HD inline std::uint64_t ordered_bits(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits ^ ((bits >> 63) != 0 ? 0xFFFFFFFFFFFFFFFFull : 0x8000000000000000ull);
}

IST_HD inline double from_ordered_bits(std::uint64_t ordered) {
  const std::uint64_t bits =
      ordered ^ ((ordered >> 63) != 0 ? 0x8000000000000000ull : 0xFFFFFFFFFFFFFFFFull);
  double x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

IST_HD inline int count_bits(std::uint32_t bits) {
  return IST_GPU_OR_HOST(__popc(bits), std::popcount(bits));
}

IST_HD inline int count_bits(std::uint64_t bits) {
  return IST_GPU_OR_HOST(__popcll(bits), std::popcount(bits));
}

/// The index of the lowest set bit. `bits` must not be 0.
IST_HD inline int lowest_bit(std::uint32_t bits) {
  return IST_GPU_OR_HOST(__ffs(static_cast<int>(bits)) - 1, std::countr_zero(bits));
}

IST_HD inline int lowest_bit(std::uint64_t bits) {
  return IST_GPU_OR_HOST(__ffsll(static_cast<long long>(bits)) - 1, std::countr_zero(bits));
}

/// The indices of the set bits, the lowest first; its own iterator.
template <class Word>
struct SetBits {
  Word left;

  IST_HD SetBits begin() const { return *this; }
  IST_HD SetBits end() const { return {0}; }
  IST_HD std::uint32_t operator*() const { return static_cast<std::uint32_t>(lowest_bit(left)); }
  IST_HD void operator++() { left &= left - 1; }
  IST_HD bool operator!=(const SetBits&) const { return left != 0; }
};

/// For loops: for (const std::uint32_t i : set_bits(bits)).
IST_HD inline SetBits<std::uint32_t> set_bits(std::uint32_t bits) { return {bits}; }
IST_HD inline SetBits<std::uint64_t> set_bits(std::uint64_t bits) { return {bits}; }

}  // namespace ist
