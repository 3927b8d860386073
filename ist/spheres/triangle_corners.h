#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "mesh/mesh_view.h"

namespace ist {

/// Unit frame.
inline std::array<Eigen::Vector3d, 3> triangle_corners(const MeshView& mesh,
                                                       std::uint32_t triangle) {
  std::array<Eigen::Vector3d, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t vertex = mesh.triangles[3 * std::size_t{triangle} + k];
    const double* const v = mesh.vertices + 3 * std::size_t{vertex};
    corners[k] = {v[0], v[1], v[2]};
  }
  return corners;
}

}  // namespace ist
