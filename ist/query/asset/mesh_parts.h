#pragma once

#include <cstdint>

#include <ist/asset.h>
#include <ist/asset_layout.h>

namespace ist {

/// The mesh of an asset with its offsets resolved, all but boxes.
struct MeshParts {
  MeshParts(const AssetHeader& asset, const MeshHeader& mesh) noexcept
      : header(&mesh),
        count(mesh.level[0].count),
        blocks(at<MeshBlock>(asset, mesh.level[0].blocks)),
        vertices(at<double>(asset, mesh.vertices)),
        shells(at<MeshShell>(asset, mesh.shells)),
        neighbours(at<std::uint32_t>(asset, mesh.neighbours)) {}

  const MeshHeader* header;
  std::uint32_t count;  ///< of blocks
  const MeshBlock* blocks;
  const double* vertices;
  const MeshShell* shells;
  const std::uint32_t* neighbours;
};

}  // namespace ist
