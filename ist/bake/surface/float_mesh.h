#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/mesh_view.h"

namespace ist {

/// A closed, oriented surface over float vertices, unit frame: every edge is run as often one way
/// as the other.
struct FloatMesh {
  using Vertex = std::array<float, 3>;
  using Triangle = std::array<std::uint32_t, 3>;  ///< counter-clockwise seen from outside

  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

/// A closed mesh over its vertices rounded to float.
FloatMesh in_floats(const MeshView& mesh);

/// Makes vertices of equal coordinates one, and reduces triangles: those with two equal corners
/// vanish, of those with the same three corners the signed sum stays. A closed surface stays closed
/// and its winding numbers what they were. Returns the new vertex of every old one; some may have
/// no triangle left.
std::vector<std::uint32_t> reduce(FloatMesh& mesh);

/// The triangles that are left of triangles whose corners are now `corner_of` each; the lowest
/// corner first, in order.
std::vector<FloatMesh::Triangle> reduced(std::vector<FloatMesh::Triangle> triangles);

}  // namespace ist
