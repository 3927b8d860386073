#pragma once

#include <ist/asset_layout.h>
#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/exact/mesh_tree.h"

namespace ist {

inline bool keeps_mesh(const PlacedAsset& placed) noexcept {
  return !placed.asset.empty() && placed.asset.header().mesh != 0;
}

/// The asset must have a mesh.
inline MeshTree mesh_of(const PlacedAsset& placed) noexcept {
  const AssetHeader& asset = placed.asset.header();
  return {asset, *at<MeshHeader>(asset, asset.mesh)};
}

inline double moved_by_poses(const PlacedAsset& a, const PlacedAsset& b, const MeshTree& mesh_b,
                             const RelativePose& pose) noexcept {
  const auto offset = [](const PlacedAsset& placed) {
    const double* c = placed.asset.header().centre;
    return placed.scale * Eigen::Vector3d(c[0], c[1], c[2]).norm();
  };
  return moved_by_poses(a.pose.t, offset(a), b.pose.t, offset(b), mesh_b.extent(), pose);
}

}  // namespace ist
