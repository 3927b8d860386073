#include "clash/world_mesh.h"

#include <ist/pose_eigen.h>
#include <algorithm>
#include <cmath>

#include "query/exact/kept_mesh.h"

namespace ist {
namespace {

constexpr double kParallel = 1e-7;  ///< of normals

}  // namespace

WorldMesh::WorldMesh(const PlacedAsset& solid, const Eigen::Vector3d& origin, double size) {
  const AssetHeader& asset = solid.asset.header();
  const MeshTree mesh = mesh_of(solid);
  const Eigen::Isometry3d place = to_isometry(solid.pose);
  const double unit = std::ldexp(1.0, asset.exponent);
  for (std::uint32_t v = 0; v < mesh.header->vertex_count; ++v) {
    const Eigen::Vector3d own = unit * vector(mesh.vertex(v)) + Eigen::Vector3d(asset.centre);
    vertices.emplace_back(place * Eigen::Vector3d(solid.scale * own));
  }
  // No direction of a part is like it.
  const Eigen::Vector3d across(0.267, 0.534, 0.802);
  for (std::uint32_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& block = mesh.blocks[b];
    for (std::uint32_t t = 0; t < block.triangles; ++t) {
      const auto corner = [&](int c) -> const Eigen::Vector3d& {
        return vertices[block.vertex[block.corner[c][t]]];
      };
      Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      const double length = normal.norm();
      if (!(length > 0)) continue;
      normal /= length;
      for (const double side : {1.0, -1.0}) {
        const Eigen::Vector3d n = side * normal;
        const double offset = n.dot(corner(0) - origin);
        planes.push_back({size * n.dot(across) + offset, n, offset});
      }
    }
  }
  std::sort(planes.begin(), planes.end(),
            [](const Plane& x, const Plane& y) { return x.key < y.key; });
  const auto same = [&](const Plane& x, const Plane& y) {
    return y.key - x.key <= 1e-12 * size && (x.normal - y.normal).norm() <= 1e-12;
  };
  planes.erase(std::unique(planes.begin(), planes.end(), same), planes.end());
}

bool have_common_plane(const WorldMesh& a, const WorldMesh& b, double size, double within) {
  const double room = within + kParallel * size;  // of keys
  std::size_t first = 0;
  for (const WorldMesh::Plane& plane : a.planes) {
    while (first < b.planes.size() && b.planes[first].key < plane.key - room) ++first;
    for (std::size_t i = first; i < b.planes.size() && b.planes[i].key <= plane.key + room; ++i)
      if (std::abs(b.planes[i].offset - plane.offset) <= within &&
          (b.planes[i].normal - plane.normal).norm() <= kParallel)
        return true;
  }
  return false;
}

}  // namespace ist
