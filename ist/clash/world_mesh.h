#pragma once

#include <ist/query.h>
#include <Eigen/Core>
#include <vector>

namespace ist {

/// A part's kept mesh where it stands.
struct WorldMesh {
  /// A triangle's plane, seen from either side: n · x = offset.
  struct Plane {
    double key;  ///< the same for equal planes, and else for hardly any two
    Eigen::Vector3d normal;
    double offset;
  };

  /// `origin`, `size`: of the whole assembly.
  WorldMesh(const PlacedAsset& solid, const Eigen::Vector3d& origin, double size);

  std::vector<Eigen::Vector3d> vertices;
  std::vector<Plane> planes;  ///< by key
};

/// Whether a plane of one lies within this [u] of one of the other: of one assembly of this size.
bool have_common_plane(const WorldMesh& a, const WorldMesh& b, double size, double within);

}  // namespace ist
