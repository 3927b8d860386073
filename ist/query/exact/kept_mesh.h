#pragma once

#include <cmath>

#include <ist/asset_layout.h>
#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/exact/mesh_tree.h"

namespace ist {

inline bool keeps_mesh(const PlacedAsset& placed) noexcept {
  return !placed.asset.empty() && placed.asset.header().mesh != 0;
}

/// Only where the asset keeps one.
inline MeshTree mesh_of(const PlacedAsset& placed) noexcept {
  const AssetHeader& asset = placed.asset.header();
  return {asset, *at<MeshHeader>(asset, asset.mesh)};
}

/// The solid's surface and the mesh lie within this of each other, unit frame.
inline double moved_in_mesh(const MeshTree& mesh) noexcept {
  return mesh.header->error + mesh.header->rounding;
}

/// How far a vertex of B may be from where the poses put it against A: A's unit frame. A rotation
/// is off by up to 37 roundings, what moves by it, and the shift between the frames, by 45 at most
/// with all that follows.
inline double moved_by_poses(const PlacedAsset& a, const PlacedAsset& b, const MeshTree& mesh_b,
                             const RelativePose& pose) noexcept {
  const auto offset = [](const PlacedAsset& placed) {
    const double* c = placed.asset.header().centre;
    return placed.scale * Eigen::Vector3d(c[0], c[1], c[2]).norm();
  };
  // The C library's hypot differs between processors.
  double between = 0;
  for (int k = 0; k < 3; ++k) between += (b.pose.t[k] - a.pose.t[k]) * (b.pose.t[k] - a.pose.t[k]);
  between = std::sqrt(between);
  return 1.1 * exact::kHalfUnit *
         (45 * (1.8 * pose.a_from_b.scale * mesh_b.extent() +
                (between + offset(a) + offset(b)) / pose.unit_a) +
          5 * vector(pose.a_from_b.t).norm());
}

}  // namespace ist
