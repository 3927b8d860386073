#pragma once

#include <algorithm>
#include <cstdint>

#include "query/asset/surface_tree.h"
#include "query/probe/surface_patch.h"

namespace ist {

/// The blocks of a surface that a query met lately: each meets several blocks of balls.
class PatchCache {
 public:
  void forget() noexcept { std::fill_n(block_, kSlots, kNone); }

  const SurfacePatch& find(const SurfaceTree& surface, std::uint32_t block) noexcept {
    const std::uint32_t slot = block % kSlots;
    if (block_[slot] != block) {
      block_[slot] = block;
      make_patch(surface.blocks[block], patch_[slot]);
    }
    return patch_[slot];
  }

 private:
  static constexpr std::uint32_t kSlots = 64;
  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t block_[kSlots];
  SurfacePatch patch_[kSlots];
};

}  // namespace ist
