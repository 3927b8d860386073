#pragma once

#include <Eigen/Core>

#include "mesh/geometry/mesh_view.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// Closest point by the double formula over every triangle, the smaller index among equals. The
/// float hierarchy and the float distances only rule triangles out, with a margin for their error.
/// If nothing is closer than `limit`: distance = limit, triangle = kNoTriangle.
ClosestPoint exact_closest_point(const MeshView& mesh, const Eigen::Vector3d& p, double limit);

}  // namespace ist
