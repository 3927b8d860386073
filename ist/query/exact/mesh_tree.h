#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "query/asset/mesh_parts.h"
#include "query/exact/orientation.h"

namespace ist {

/// The mesh of an asset with its tree of boxes, unit frame.
///
/// Lane l of box block b at level k + 1 is the box around block 16 b + l of level k.
struct MeshTree : MeshParts {
  struct Level {
    const BoxBlock* boxes = nullptr;  ///< level 0 has none
    const BoxSums* sums = nullptr;
    std::uint32_t count = 0;  ///< blocks at this level, level 0 included
    std::uint32_t first = 0;  ///< box blocks of the levels below
  };

  MeshTree(const AssetHeader& asset, const MeshHeader& mesh) noexcept
      : MeshParts(asset, mesh),
        hash(asset.content_hash),
        top(static_cast<int>(mesh.level_count) - 1) {
    level[0].count = mesh.level[0].count;
    for (int k = 1; k <= top; ++k) {
      const LevelHeader& from = mesh.level[k];
      level[k] = {at<BoxBlock>(asset, from.blocks), at<BoxSums>(asset, from.nodes), from.count,
                  k > 1 ? level[k - 1].first + level[k - 1].count : 0};
    }
    const BoxBlock& root = level[top].boxes[0];
    for (int k = 0; k < 3; ++k) {
      low[k] = *std::min_element(root.low[k], root.low[k] + kWidth);  // unused ones are empty
      high[k] = *std::max_element(root.high[k], root.high[k] + kWidth);
    }
  }

  exact::Point vertex(std::uint32_t v) const noexcept {
    const double* x = vertices + std::size_t{3} * v;
    return {x[0], x[1], x[2]};
  }

  /// No coordinate is larger.
  double extent() const noexcept {
    double extent = 0;
    for (int k = 0; k < 3; ++k)
      extent = std::max({extent, std::abs(double{low[k]}), std::abs(double{high[k]})});
    return extent;
  }

  std::uint64_t hash;  ///< of the asset
  int top;             ///< the level of one box block, ≥ 1
  Level level[kMaxLevels];
  float low[3], high[3];  ///< a box around it
};

}  // namespace ist
