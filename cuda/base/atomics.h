#pragma once

#include <cstdint>
#include <cstring>

#include "base/host_device.h"

// Relaxed atomics for host and device. Each returns the previous value. They build only sums,
// maxima and sets, so results do not depend on the order of threads.

namespace ist::gpu {

IST_HD inline std::uint32_t atomic_add(std::uint32_t* at, std::uint32_t value) {
  return IST_GPU_OR_HOST(atomicAdd(at, value), __atomic_fetch_add(at, value, __ATOMIC_RELAXED));
}

IST_HD inline std::uint64_t atomic_add(std::uint64_t* at, std::uint64_t value) {
  return IST_GPU_OR_HOST(atomicAdd(reinterpret_cast<unsigned long long*>(at), value),
                         __atomic_fetch_add(at, value, __ATOMIC_RELAXED));
}

IST_HD inline std::uint32_t atomic_or(std::uint32_t* at, std::uint32_t bits) {
  return IST_GPU_OR_HOST(atomicOr(at, bits), __atomic_fetch_or(at, bits, __ATOMIC_ACQ_REL));
}

IST_HD inline std::uint32_t atomic_and(std::uint32_t* at, std::uint32_t bits) {
  return IST_GPU_OR_HOST(atomicAnd(at, bits), __atomic_fetch_and(at, bits, __ATOMIC_RELAXED));
}

IST_HD inline std::uint32_t atomic_exchange(std::uint32_t* at, std::uint32_t value) {
  return IST_GPU_OR_HOST(atomicExch(at, value), __atomic_exchange_n(at, value, __ATOMIC_RELEASE));
}

/// Adds the first lane's `count` to a number that teams share, and returns its previous value.
template <class Team>
IST_HD std::uint32_t take(const Team& team, std::uint32_t* at, std::uint32_t count) {
  std::uint32_t first = 0;
  if (team.lane() == 0) first = atomic_add(at, count);
  return team.broadcast(first, 0);
}

/// The index of this lane's item in a list to which each lane with `adds` appends one.
template <class Team>
IST_HD std::uint32_t append(const Team& team, bool adds, std::uint32_t* size) {
  int total = 0;
  const auto before = static_cast<std::uint32_t>(team.exclusive_count(adds, total));
  return total == 0 ? 0 : take(team, size, static_cast<std::uint32_t>(total)) + before;
}

/// Writes `value` if the current value is `expected`.
IST_HD inline std::uint32_t atomic_replace(std::uint32_t* at, std::uint32_t expected,
                                           std::uint32_t value) {
#ifdef __CUDA_ARCH__
  return atomicCAS(at, expected, value);
#else
  __atomic_compare_exchange_n(at, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
#endif
}
IST_HD inline std::uint64_t atomic_replace(std::uint64_t* at, std::uint64_t expected,
                                           std::uint64_t value) {
#ifdef __CUDA_ARCH__
  return atomicCAS(reinterpret_cast<unsigned long long*>(at), expected, value);
#else
  __atomic_compare_exchange_n(at, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
#endif
}

IST_HD inline std::uint32_t atomic_max(std::uint32_t* at, std::uint32_t value) {
#ifdef __CUDA_ARCH__
  return atomicMax(at, value);
#else
  std::uint32_t old = __atomic_load_n(at, __ATOMIC_RELAXED);
  while (old < value &&
         !__atomic_compare_exchange_n(at, &old, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
  return old;
#endif
}

/// Release and acquire fence. Everything that this thread's team wrote before its last sync becomes
/// visible to threads that read what this thread then stores atomically. After an atomic load, data
/// published in this way is visible to this thread.
IST_HD inline void publish() {
#ifdef __CUDA_ARCH__
  __threadfence();
#endif  // the host's atomic_exchange() and atomic_or() do it themselves
}

struct alignas(16) Words4 {
  std::uint32_t word[4];
};

/// A load that bypasses the multiprocessor's own cache.
IST_HD inline std::uint32_t load_fresh(const std::uint32_t* at) {
  return IST_GPU_OR_HOST(__ldcg(at), *at);
}
IST_HD inline float load_fresh(const float* at) { return IST_GPU_OR_HOST(__ldcg(at), *at); }
IST_HD inline Words4 load_fresh(const Words4* at) {
#ifdef __CUDA_ARCH__
  const uint4 words = __ldcg(reinterpret_cast<const uint4*>(at));
  return {{words.x, words.y, words.z, words.w}};
#else
  return *at;
#endif
}

/// Writes a value that other threads may be reading.
IST_HD inline void atomic_store(std::uint32_t* at, std::uint32_t value) {
  IST_GPU_OR_HOST(*static_cast<volatile std::uint32_t*>(at) = value,
                  __atomic_store_n(at, value, __ATOMIC_RELEASE));
}

/// Reads a value that other threads may be writing.
IST_HD inline std::uint32_t atomic_load(const std::uint32_t* at) {
  return IST_GPU_OR_HOST(*static_cast<const volatile std::uint32_t*>(at),
                         __atomic_load_n(at, __ATOMIC_ACQUIRE));
}
IST_HD inline std::uint64_t atomic_load(const std::uint64_t* at) {
  return IST_GPU_OR_HOST(*static_cast<const volatile std::uint64_t*>(at),
                         __atomic_load_n(at, __ATOMIC_ACQUIRE));
}
IST_HD inline double atomic_load(const double* at) {
  const std::uint64_t bits = atomic_load(reinterpret_cast<const std::uint64_t*>(at));
  double x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// Writes x if sign · x is less than sign times the current value.
IST_HD inline void atomic_lower(double* at, double x, double sign) {
  std::uint64_t to;
  std::memcpy(&to, &x, sizeof to);
  for (double now = atomic_load(at); sign * x < sign * now;) {
    std::uint64_t from;
    std::memcpy(&from, &now, sizeof from);
    if (atomic_replace(reinterpret_cast<std::uint64_t*>(at), from, to) == from) return;
    now = atomic_load(at);
  }
}

}  // namespace ist::gpu
