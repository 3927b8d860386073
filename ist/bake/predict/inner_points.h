#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

/// About `count` points [u] spread evenly over the solid: a share of them inside a body is about
/// the share of the solid's volume that lies in it. Same points on any machine and for any number
/// of threads; runs on the caller's TBB threads.
std::vector<Eigen::Vector3d> inner_points(const MeshSolid& solid, std::size_t count);

}  // namespace ist
