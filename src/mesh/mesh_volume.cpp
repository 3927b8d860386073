#include "mesh/mesh_volume.h"

#include <cmath>
#include <cstddef>

namespace ist {
namespace {

/// Divergence theorem: the sum of signed tetrahedra over the origin, in index order.
MeshVolume enclosed_volume(const MeshView& mesh) {
  double sum = 0, lost = 0, magnitude = 0;  // Neumaier's compensated sum
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    const auto corner = [&](std::size_t i) {
      return mesh.vertices_exact + 3 * std::size_t{mesh.triangles[3 * t + i]};
    };
    const double *a = corner(0), *b = corner(1), *c = corner(2);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      const double left = b[j] * c[k], right = b[k] * c[j];
      const double term = a[i] * (left - right) / 6;
      magnitude += std::abs(a[i]) * (std::abs(left) + std::abs(right)) / 6;
      const double next = sum + term;
      lost += std::abs(sum) >= std::abs(term) ? (sum - next) + term : (term - next) + sum;
      sum = next;
    }
  }
  return {sum + lost, 8 * 0x1p-53 * magnitude};
}

}  // namespace

MeshVolume mesh_volume(const MeshView& mesh) { return enclosed_volume(mesh); }

}  // namespace ist
