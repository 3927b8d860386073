#pragma once

#include <cstdint>
#include <vector>

#include "query/exact/mesh_tree.h"

namespace ist::gpu {

/// A block of a mesh in float, laid out for lanes that read consecutive numbers.
struct alignas(64) FloatBlock {
  float x[3][kWidth];  ///< vertices, unit frame
  std::uint32_t
      corner[kWidth];  ///< positions of a triangle's corners, a byte each; last byte 1 if it exists
};
static_assert(sizeof(FloatBlock) == 256);

inline std::vector<FloatBlock> float_blocks(const MeshTree& mesh) {
  std::vector<FloatBlock> out(mesh.count);
  for (std::uint32_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& from = mesh.blocks[b];
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      const exact::Point x = mesh.vertex(from.vertex[l]);
      for (int k = 0; k < 3; ++k) out[b].x[k][l] = static_cast<float>(x[k]);
      if (l < from.triangles)
        out[b].corner[l] = from.corner[0][l] | static_cast<std::uint32_t>(from.corner[1][l]) << 8 |
                           static_cast<std::uint32_t>(from.corner[2][l]) << 16 | 1u << 24;
    }
  }
  return out;
}

}  // namespace ist::gpu
