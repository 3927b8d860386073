#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/ray_crossing.h"

// Winding numbers by rays parallel to x. A ray is thought to be moved by an infinitesimal amount in
// z and a larger infinitesimal in y, so that it meets no edge and no vertex; every predicate is
// exact. A closed mesh's crossings then sum to zero on every line, and the winding number of a
// point off the surface is right however close it is.

namespace ist {

/// Winding number of p (unit frame) about a closed mesh.
int winding_number(const MeshView& mesh, const double p[3]);

/// All crossings of the line (·, y, z), sorted by x, +1 first among equals.
void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out);

/// [line] The same of many lines (y, z). Needs the mesh's arrays alone: to build a hierarchy costs
/// more than a few thousand lines do. On the caller's TBB threads.
ItemGroups<std::uint32_t, Crossing> line_crossings(const MeshView& mesh,
                                                   const std::vector<std::array<double, 2>>& lines);

}  // namespace ist
