#pragma once

#include <ist/asset.h>
#include <Eigen/Core>
#include <vector>

namespace ist {

/// A sphere of an asset in the mesh's own unit and frame.
struct ExportedSphere {
  Eigen::Vector3d centre;          ///< [u] of the inner sphere
  double radius = 0;               ///< [u] rounded down: certified around the rounded centre
  Eigen::Vector3d matched_centre;  ///< [u]
  double matched_radius = 0;       ///< [u]
  double cover_radius = 0;         ///< [u] about `centre`, rounded up
};

/// The spheres of a detail in [0, header().detail_count]: the first of the inner spheres, with the
/// matched spheres that replace them.
std::vector<ExportedSphere> exported_spheres(const AssetView& tree, std::uint32_t detail);

// Text of a whole file: columns x,y,z,r,ex,ey,ez,er,c, 17 digits.
std::string spheres_csv(std::span<const ExportedSphere> spheres);
std::string spheres_ply(std::span<const ExportedSphere> spheres);
std::string spheres_json(std::span<const ExportedSphere> spheres);

}  // namespace ist
