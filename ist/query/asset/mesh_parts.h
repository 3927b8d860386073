#pragma once

#include <cstdint>

#include <ist/asset.h>
#include <ist/asset_layout.h>

namespace ist {

/// The mesh of an asset with its offsets resolved, except those of its boxes.
struct MeshParts {
  MeshParts() = default;
  MeshParts(const AssetHeader& asset, const MeshHeader& mesh) noexcept
      : header(&mesh),
        count(mesh.level[0].count),
        blocks(at<MeshBlock>(asset, mesh.level[0].blocks)),
        vertices(at<double>(asset, mesh.vertices)),
        shells(at<MeshShell>(asset, mesh.shells)),
        neighbours(at<std::uint32_t>(asset, mesh.neighbours)) {}

  const MeshHeader* header = nullptr;
  std::uint32_t count = 0;  ///< blocks
  const MeshBlock* blocks = nullptr;
  const double* vertices = nullptr;
  const MeshShell* shells = nullptr;
  const std::uint32_t* neighbours = nullptr;
};

}  // namespace ist
