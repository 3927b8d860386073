#pragma once

#include <ist/mesh.h>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// Triangles and their edges during a repair.
struct Surface {
  TriangleMesh mesh;
  EdgeTable edges{mesh.triangles};

  void triangles_changed() { edges = EdgeTable(mesh.triangles); }
};

/// Drops walls between parts of the solid that share them: patches at edges of three and more faces
/// with solid on both sides, if fewer odd edges are left without them. Adds a note.
void drop_inner_walls(Surface& surface, MeshReport& report);

/// Closes a mesh with odd edges: closes cracks with a growing tolerance up to 1e-5 of the diagonal,
/// drops fins and open sheets, caps the remaining holes. Adds notes to the report. The result is
/// not oriented yet. Throws Error if nothing is left.
void repair(Surface& surface, const std::string& name, MeshReport& report);

/// Describes a mesh that cannot be repaired, for an error message.
inline constexpr const char* kWrapIt =
    "Close it, or wrap it: --wrap 0.5%, in a manifest wrap = '0.5%', in C++ wrap_mesh()";

/// Edges of one triangle that contain a vertex of another such edge.
std::size_t count_t_junctions(const TriangleMesh& mesh, const EdgeTable& edges);

/// A closed walk along edges that have an odd number of sides.
struct BorderLoop {
  std::vector<std::uint32_t> vertices;  ///< in order, each once
  std::uint32_t edge = kNoIndex;        ///< one of its edges
};

/// Loops that together use every odd edge once. They exist, since a surface's border has no end.
std::vector<BorderLoop> border_loops(const EdgeTable& edges);

/// Triangles that span a loop, in its plane if it is planar.
std::vector<Triangle> cap(const std::vector<Eigen::Vector3d>& vertices, const BorderLoop& loop);

}  // namespace ist
