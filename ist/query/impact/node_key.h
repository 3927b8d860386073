#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

#include "query/asset/sphere_tree.h"

namespace ist {

/// A node of a tree in 32 bits, level and number: spheres and triangles come first.
struct NodeKey {
  int level;
  std::uint32_t number;

  static NodeKey of(std::uint32_t bits) noexcept {
    return {static_cast<int>(bits >> kNumberBits) + kSphereLevel, bits & ((1u << kNumberBits) - 1)};
  }
  std::uint32_t bits() const noexcept {
    return static_cast<std::uint32_t>(level - kSphereLevel) << kNumberBits | number;
  }

  static constexpr int kNumberBits = 28;  // 16^7 spheres
};
static_assert(kMaxSpheres == std::uint64_t{1} << NodeKey::kNumberBits);

}  // namespace ist
