#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/geometry/mesh_view.h"

namespace ist {

/// A closed, oriented mesh over float vertices, unit frame.
struct FloatMesh {
  using Vertex = std::array<float, 3>;
  using Triangle = std::array<std::uint32_t, 3>;  ///< counter-clockwise seen from outside

  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

/// A closed mesh over its vertices rounded to float.
FloatMesh in_floats(const MeshView& mesh);

}  // namespace ist
