#pragma once

#include <cstdint>
#include <vector>

#include <ist/mesh.h>

#include "mesh/edge_table.h"

namespace ist {

/// A closed walk along edges that have an odd number of sides.
struct BorderLoop {
  std::vector<std::uint32_t> vertices;  ///< in order, each once
  std::uint32_t edge = kNoIndex;        ///< one of its edges
};

/// Loops that together run along every odd edge once. (There are always such: the border of a
/// surface has no end.)
std::vector<BorderLoop> border_loops(const EdgeTable& edges);

/// Triangles that span a loop, in its own plane where it has one.
std::vector<Triangle> cap(const std::vector<Eigen::Vector3d>& vertices, const BorderLoop& loop);

}  // namespace ist
