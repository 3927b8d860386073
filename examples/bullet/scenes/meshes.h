#pragma once

#include <ist/mesh.h>

#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

// Closed meshes of the scenes, made on the spot.

/// The boundary of the cells (i, j, k) of a grid that `filled` names; cells lie between
/// neighbouring planes. Cells that touch in an edge alone are not for it.
ist::TriangleMesh make_cells(const std::vector<double>& x, const std::vector<double>& y,
                             const std::vector<double>& z,
                             const std::function<bool(int, int, int)>& filled);

ist::TriangleMesh make_box(const Eigen::Vector3d& half_extents);

/// A (radius, z) profile turned about z. It runs counter-clockwise with z up and the radius to the
/// right: closed, or from the axis to the axis.
ist::TriangleMesh make_turned(const std::vector<std::pair<double, double>>& profile, int segments);

ist::TriangleMesh make_ball(double radius, int segments);
