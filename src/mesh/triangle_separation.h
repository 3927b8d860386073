#pragma once

#include <Eigen/Core>
#include <vector>

#include "mesh/edge_table.h"

namespace ist {

/// True: two triangles are proven not to meet elsewhere than in the corners and sides they share,
/// by a plane or by a line along an axis that keeps them apart. In double, with a bound on the
/// rounding. False says nothing: meet_elsewhere() decides.
bool seen_apart(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a, const Triangle& b);

}  // namespace ist
