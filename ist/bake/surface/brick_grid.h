#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include <ist/asset_layout.h>

namespace ist {

/// Cubes of cells, four along an edge, over the bounds of the surface.
struct BrickGrid {
  static constexpr double kMargin = 0.0625;  ///< of a cell, from the lowest corner of the surface

  double low[3], cell;
  std::uint32_t bricks[3];

  BrickGrid(const double from[3], const double to[3], double edge) : cell(edge) {
    for (int k = 0; k < 3; ++k) {
      low[k] = from[k] - kMargin * cell;
      bricks[k] = static_cast<std::uint32_t>(
          std::floor((to[k] + kMargin * cell - low[k]) / (kBrickWidth * cell)) + 1);
    }
  }

  double brick_places() const { return double{1} * bricks[0] * bricks[1] * bricks[2]; }
  std::uint32_t cells(int k) const { return kBrickWidth * bricks[k]; }

  /// Its brick's place · 64 + its bit.
  std::uint64_t name(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    const std::uint64_t brick =
        x / kBrickWidth +
        std::uint64_t{bricks[0]} * (y / kBrickWidth + std::uint64_t{bricks[1]} * (z / kBrickWidth));
    return 64 * brick + x % kBrickWidth + 4 * (y % kBrickWidth) + 16 * (z % kBrickWidth);
  }

  std::array<double, 3> reference(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return {low[0] + (x + kCellReference[0]) * cell, low[1] + (y + kCellReference[1]) * cell,
            low[2] + (z + kCellReference[2]) * cell};
  }
};

}  // namespace ist
