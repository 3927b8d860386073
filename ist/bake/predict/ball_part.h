#pragma once

#include <Eigen/Core>

#include "mesh/mesh_solid.h"

namespace ist {

/// [u³] What a ball has inside the solid, to rounding; the mesh must wind around every point once
/// or not at all. Looks at every triangle.
double ball_part(const MeshSolid& solid, const Eigen::Vector3d& centre, double radius);

}  // namespace ist
