#include "build/turned_solid.h"

#include <cmath>

namespace ist {
namespace {

// A turned copy of the mesh costs memory and time: only for a shadow smaller than this part of the
// largest.
constexpr double kSmallShadow = 0.25;

Eigen::Vector3d cycled(const Eigen::Vector3d& x, int axis) {
  return {x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3]};
}

}  // namespace

Eigen::Vector3d shadow_areas(const MeshView& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    const std::uint32_t* corner = mesh.triangles + 3 * std::size_t{t};
    const double* a = mesh.vertices_exact + 3 * std::size_t{corner[0]};
    const double* b = mesh.vertices_exact + 3 * std::size_t{corner[1]};
    const double* c = mesh.vertices_exact + 3 * std::size_t{corner[2]};
    for (int k = 0; k < 3; ++k) {
      const int u = (k + 1) % 3, v = (k + 2) % 3;
      sum[k] += std::abs((b[u] - a[u]) * (c[v] - a[v]) - (c[u] - a[u]) * (b[v] - a[v]));
    }
  }
  return sum / 4;  // half the parallelograms, and half of the crossings enter
}

TurnedSolid::TurnedSolid(const MeshSolid& solid) : original_(solid) {
  const MeshView& view = solid.view();
  const Eigen::Vector3d shadow = shadow_areas(view);
  int largest = 0;
  const double area = shadow.maxCoeff(&largest);
  if (shadow.x() >= kSmallShadow * area) return;
  axis_ = largest;
  ClosedMesh mesh;
  mesh.name = "turned mesh";
  for (std::size_t v = 0; v < view.vertex_count; ++v) {
    const double* x = view.vertices_exact + 3 * v;
    mesh.mesh.vertices.push_back(cycled({x[0], x[1], x[2]}, axis_));
  }
  for (std::size_t t = 0; t < view.triangle_count; ++t) {
    const std::uint32_t* corner = view.triangles + 3 * t;
    mesh.mesh.triangles.push_back({corner[0], corner[1], corner[2]});
  }
  mesh.report.closed = true;
  turned_ = std::make_unique<MeshSolid>(mesh);
}

Eigen::Vector3d TurnedSolid::turn(const Eigen::Vector3d& x) const {
  return turned_ ? turned_->frame().to_unit(cycled(x, axis_)) : x;
}

Eigen::Vector3d TurnedSolid::turn_back(const Eigen::Vector3d& x) const {
  return turned_ ? cycled(turned_->frame().from_unit(x), (3 - axis_) % 3) : x;
}

}  // namespace ist
