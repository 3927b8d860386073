#pragma once

#include <ist/query.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
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

/// Allocates by a caller's hooks, or by operator new without hooks. Throws std::bad_alloc.
inline void* take_memory(const MemoryHooks& hooks, std::size_t bytes, std::size_t alignment) {
  if (hooks.allocate == nullptr) return ::operator new(bytes, std::align_val_t(alignment));
  void* const memory = hooks.allocate(hooks.context, bytes, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

inline void give_memory_back(const MemoryHooks& hooks, void* memory, std::size_t bytes,
                             std::size_t alignment) noexcept {
  if (hooks.allocate == nullptr) {
    ::operator delete(memory, std::align_val_t(alignment));
  } else if (hooks.release != nullptr) {
    hooks.release(hooks.context, memory, bytes, alignment);
  }
}

struct HookedRelease {
  MemoryHooks hooks;
  std::size_t bytes = 0, alignment = 1;
  void operator()(void* memory) const noexcept {
    give_memory_back(hooks, memory, bytes, alignment);
  }
};

template <class T>
using HookedArray = std::unique_ptr<T[], HookedRelease>;

/// An uninitialised array: pages that are never used cost address space, not memory.
template <class T>
HookedArray<T> hooked_array(const MemoryHooks& hooks, std::size_t count) {
  static_assert(std::is_trivially_destructible_v<T>);
  if (count > std::numeric_limits<std::size_t>::max() / sizeof(T)) throw std::bad_alloc();
  const std::size_t bytes = count * sizeof(T);
  return {static_cast<T*>(take_memory(hooks, bytes, alignof(T))), {hooks, bytes, alignof(T)}};
}

template <class T>
using Hooked = std::unique_ptr<T, HookedRelease>;

template <class T>
Hooked<T> hooked(const MemoryHooks& hooks) {
  T* const value = new (hooked_array<T>(hooks, 1).release()) T;
  return {value, {hooks, sizeof(T), alignof(T)}};
}

}  // namespace ist
