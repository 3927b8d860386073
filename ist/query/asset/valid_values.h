#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

// Whether values of an asset's bytes are what a query may count on.

namespace ist {

inline constexpr std::uint32_t kMostBlocks = 1u << 4 * (kMaxLevels - 1);  ///< of a level

// Comparisons are written so that NaN fails them.
inline bool in_range(double value, double low, double high) noexcept {
  return value >= low && value <= high;
}
inline bool is_offset(double value) noexcept { return in_range(value, -kMaxExtent, kMaxExtent); }
inline bool is_radius(double value) noexcept { return in_range(value, 0, kMaxExtent); }

/// The first `used` lanes are balls, the rest are marked empty.
inline bool sound_block(const BallBlock& block, std::uint64_t used) noexcept {
  bool sound = true;
  for (std::uint32_t l = 0; l < kWidth; ++l) {
    if (l < used)
      sound &= is_offset(block.x[l]) && is_offset(block.y[l]) && is_offset(block.z[l]) &&
               is_radius(block.r[l]);
    else
      sound &= block.x[l] == 0 && block.y[l] == 0 && block.z[l] == 0 && block.r[l] == kEmptyRadius;
  }
  return sound;
}

inline bool sound_origin(const Origin& origin) noexcept {
  return is_offset(origin.x) && is_offset(origin.y) && is_offset(origin.z);
}

/// The mass properties and bounds of an asset could be those of some solid.
bool sound_mass(const AssetHeader& header) noexcept;

/// The counts by which the mesh's sections are placed.
bool sound_mesh_counts(const MeshHeader& mesh) noexcept;

/// The rest, once its sections are where they should be: every index that a query follows leads
/// into its array, every number is finite, neighbours know each other.
bool sound_mesh(const AssetHeader& header, const MeshHeader& mesh) noexcept;

}  // namespace ist
