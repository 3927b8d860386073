#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

std::array<Eigen::Vector3d, 3> corners_in(const MeshView& mesh, std::uint32_t triangle);

/// The winding number just outside a part of a triangle, where its normal points to; nothing where
/// no point close to its middle is found that is nearer to the triangle than to all others.
std::optional<int> winding_outside(const MeshSolid& solid, std::uint32_t triangle,
                                   const std::array<Eigen::Vector3d, 3>& part);

/// The winding number just outside every triangle, where it is known; nothing of those `apart`.
/// [triangle] `apart`: 1 for those that meet others elsewhere than in shared corners and sides: all
/// of them.
std::vector<std::optional<int>> windings_outside(const MeshSolid& solid,
                                                 const std::vector<std::uint8_t>& apart);

}  // namespace ist
