#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mesh/edge_table.h"

namespace ist {

/// [vertex] 1 where the triangles about it are proven not to meet elsewhere than in the corners and
/// sides they share: they follow one another in a closed fan that, seen from some direction, goes
/// once around the vertex and has all its triangles facing the viewer. 0 says nothing. On the
/// caller's TBB threads.
std::vector<std::uint8_t> spread_fans(const std::vector<Eigen::Vector3d>& vertices,
                                      const std::vector<Triangle>& triangles);

}  // namespace ist
