#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/field/field_mesh.h"
#include "mesh/mesh_view.h"

namespace ist {

/// A surface with its vertices clustered.
struct Clustered {
  FieldMesh mesh;
  std::vector<std::uint32_t> vertex_of;  ///< a mesh vertex's place in `mesh`
};

/// Smallest cell of the grid of clusters, unit frame.
inline constexpr double kSmallestCell = 0x1p-18;

/// Vertices of a closed mesh (arrays alone) in one cell of a uniform grid become one, placed near
/// the planes of the triangles there, at most half a cell outside of the cell. What is left of the
/// triangles is closed, and as a chain the image of the mesh. `cell`: edge, unit frame, ≥
/// kSmallestCell. Deterministic.
Clustered cluster_vertices(const MeshView& mesh, double cell);

/// How many triangles cluster_vertices() leaves before coordinates are rounded.
std::size_t clustered_triangles(const MeshView& mesh, double cell);

}  // namespace ist
