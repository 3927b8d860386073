#include "mesh/outward_winding.h"

#include <utility>

#include "mesh/edge_table.h"
#include "mesh/orient_soup.h"
#include "mesh/surface_reduction.h"

namespace ist {

std::unique_ptr<MeshSolid> triangles_as_solid(TriangleMesh mesh) {
  ClosedMesh surface;
  surface.mesh = std::move(mesh);
  surface.name = "triangles";
  return std::make_unique<MeshSolid>(surface);
}

OutwardWinding::OutwardWinding(TriangleMesh mesh) {
  reduce_coincident(mesh.triangles, EdgeTable(mesh.triangles));
  if (mesh.triangles.empty()) return;
  orient_soup(mesh);
  surface_ = triangles_as_solid(std::move(mesh));
  winding_.emplace(surface_->view());
}

double OutwardWinding::at(const Eigen::Vector3d& x) const {
  if (!winding_) return 0;
  const Eigen::Vector3d unit = surface_->frame().to_unit(x);
  return winding_->at(unit.data());
}

}  // namespace ist
