#pragma once

#include <ist/asset_layout.h>

namespace ist {

/// The counts by which the mesh's sections are placed.
bool sound_mesh_counts(const MeshHeader& mesh) noexcept;

/// The rest, once its sections are where they should be: every index that a query follows leads
/// into its array, every number is finite, neighbours know each other.
bool sound_mesh(const AssetHeader& header, const MeshHeader& mesh) noexcept;

}  // namespace ist
