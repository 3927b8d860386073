#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

// Validation of the values in an asset's bytes.

namespace ist {

inline constexpr std::uint32_t kMostBlocks = 1u << 4 * (kMaxLevels - 1);  ///< in a level

// Comparisons are written so that NaN fails them.
inline bool in_range(double value, double low, double high) noexcept {
  return value >= low && value <= high;
}
inline bool is_offset(double value) noexcept { return in_range(value, -kMaxExtent, kMaxExtent); }
inline bool is_radius(double value) noexcept { return in_range(value, 0, kMaxExtent); }

/// True if the first `used` lanes are balls and the others are marked empty.
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

/// True if some solid can have these mass properties and bounds.
bool sound_mass(const AssetHeader& header) noexcept;

/// True if the counts by which place_sections() places the mesh's sections are in range.
bool sound_mesh_counts(const MeshHeader& mesh) noexcept;

/// True if every index of a mesh with sound sections is within its array, every number is in range,
/// and the relation of neighbours is symmetric.
bool sound_mesh(const AssetHeader& header, const MeshHeader& mesh) noexcept;

}  // namespace ist
