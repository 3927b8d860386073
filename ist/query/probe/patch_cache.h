#pragma once

#include <cstdint>

#include "query/asset/surface_tree.h"
#include "query/base/placed_cache.h"
#include "query/probe/surface_patch.h"

namespace ist {

/// The blocks of a surface that a query met lately: each meets several blocks of balls.
struct PatchCache : PlacedCache<SurfacePatch, 64> {
  const SurfacePatch& find(const SurfaceTree& surface, std::uint32_t block) noexcept {
    const auto [patch, held] = PlacedCache::find(block);
    if (!held) make_patch(surface.blocks[block], patch);
    return patch;
  }
};

}  // namespace ist
