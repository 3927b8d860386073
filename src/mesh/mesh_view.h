#pragma once

#include <cstdint>

namespace ist {

/// Plain arrays of a mesh in its unit frame, for host and device code alike. Owned by MeshSolid.
struct MeshView {
  const float* vertices = nullptr;           ///< float[3 · vertex_count], unit frame, rounded
  const double* vertices_exact = nullptr;    ///< double[3 · vertex_count], unit frame
  const std::uint32_t* triangles = nullptr;  ///< uint32[3 · triangle_count]
  std::uint32_t vertex_count = 0;
  std::uint32_t triangle_count = 0;
  /// No float vertex is further than this from its exact position, unit frame.
  float vertex_error = 0;
};

}  // namespace ist
