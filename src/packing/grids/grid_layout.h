#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "base/vec3.h"

namespace ist::packing {

/// Nothing is decided closer than this to a cell's border, unit frame: it covers the rounding of
/// float coordinates and of float distances (float_distance_error), so that what is listed and
/// what is searched always covers what counts.
constexpr float kListMargin = 2e-6f;
constexpr float kSearchMargin = 8e-6f;

/// A box of cubic cells. Cell borders are exact floats (make_grid_layout), at every refinement.
struct GridLayout {
  Float3 origin;
  float size = 1;          ///< edge of a cell, unit frame
  float inverse_size = 1;  ///< rounded
  int n[3] = {1, 1, 1};    ///< cells along x, y, z
  int level = 0;           ///< how often it was split in 8

  IST_HD std::uint32_t count() const {
    return static_cast<std::uint32_t>(n[0]) * static_cast<std::uint32_t>(n[1]) *
           static_cast<std::uint32_t>(n[2]);
  }
  IST_HD std::uint32_t id(int i, int j, int k) const {
    return (static_cast<std::uint32_t>(k) * static_cast<std::uint32_t>(n[1]) +
            static_cast<std::uint32_t>(j)) *
               static_cast<std::uint32_t>(n[0]) +
           static_cast<std::uint32_t>(i);
  }
  IST_HD void coordinates(std::uint32_t id, int& i, int& j, int& k) const {
    const auto nx = static_cast<std::uint32_t>(n[0]), ny = static_cast<std::uint32_t>(n[1]);
    i = static_cast<int>(id % nx);
    j = static_cast<int>(id / nx % ny);
    k = static_cast<int>(id / nx / ny);
  }

  IST_HD float low_x(int i) const { return origin.x + static_cast<float>(i) * size; }
  IST_HD float low_y(int j) const { return origin.y + static_cast<float>(j) * size; }
  IST_HD float low_z(int k) const { return origin.z + static_cast<float>(k) * size; }
  IST_HD Float3 low(int i, int j, int k) const { return {low_x(i), low_y(j), low_z(k)}; }

  /// The cell along one axis that contains the coordinate, clamped; off by rounding near a border.
  IST_HD static int along(float x, float from, float inverse_size, int count) {
    const auto i = static_cast<int>((x - from) * inverse_size);
    return i < 0 ? 0 : (i >= count ? count - 1 : i);
  }
  IST_HD int at_x(float x) const { return along(x, origin.x, inverse_size, n[0]); }
  IST_HD int at_y(float y) const { return along(y, origin.y, inverse_size, n[1]); }
  IST_HD int at_z(float z) const { return along(z, origin.z, inverse_size, n[2]); }
};

/// A grid over a box, `start` ≥ 1 cells on its longest side, that can be refined `refinements` ≥ 0
/// times; start · 2^refinements ≤ kMostGridCells.
GridLayout make_grid_layout(const double lower[3], const double upper[3], int start,
                            int refinements);

IST_HD inline GridLayout refined(const GridLayout& g) {
  GridLayout f = g;
  f.size = 0.5f * g.size;
  f.inverse_size = 2 * g.inverse_size;
  f.n[0] = 2 * g.n[0];
  f.n[1] = 2 * g.n[1];
  f.n[2] = 2 * g.n[2];
  f.level = g.level + 1;
  return f;
}

}  // namespace ist::packing
