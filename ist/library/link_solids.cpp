#include "library/link_solids.h"

#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/types.h>
#include <tbb/enumerable_thread_specific.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/geometry/closest_point.h"
#include "mesh/mesh_solid.h"
#include "robots/description/link_mesh.h"

namespace ist {

struct LinkSolids::Workspaces {
  tbb::enumerable_thread_specific<Workspace> each;
};

LinkSolids::LinkSolids() : workspaces_(std::make_unique<Workspaces>()) {}
LinkSolids::~LinkSolids() = default;

std::string LinkSolids::add(const ClosedMesh* mesh, std::span<const CoverSphere> spheres) {
  assets_.emplace_back();
  meshes_.emplace_back();
  try {
    ClosedMesh all = mesh == nullptr ? ClosedMesh{} : *mesh;
    for (const CoverSphere& s : spheres)
      append_mesh(all.mesh, capsule_mesh({s.centre, s.centre, s.radius}).mesh);
    if (!spheres.empty()) all = close_mesh(std::move(all.mesh), "link");
    assets_.back() = std::make_unique<const Asset>(bake_mesh_only(all));
    meshes_.back() = std::make_unique<const MeshSolid>(all);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

bool LinkSolids::overlap(std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) const {
  if (!assets_[a] || !assets_[b]) return true;
  const Penetration found = penetration(PlacedSolid(assets_[a]->view(), Pose{}),
                                        PlacedSolid(assets_[b]->view(), to_pose(b_in_a)),
                                        {.measure = Measure::exact}, workspaces_->each.local());
  return found.status != QueryStatus::ok || found.volume_min > 0;
}

double LinkSolids::gap(std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) const {
  if (!assets_[a] || !assets_[b]) return 0;
  return separation(PlacedSolid(assets_[a]->view(), Pose{}),
                    PlacedSolid(assets_[b]->view(), to_pose(b_in_a)), {}, workspaces_->each.local())
      .distance_min;
}

double LinkSolids::distance(std::size_t link, const Eigen::Vector3d& point, double most) const {
  if (!meshes_[link]) return 0;
  const MeshSolid& mesh = *meshes_[link];
  if (mesh.bounds().squaredExteriorDistance(point) >= most * most) return most;
  const Eigen::Vector3d at = mesh.frame().to_unit(point);
  const Eigen::Vector3f p = at.cast<float>();
  const double scale = mesh.frame().scale(), limit = most / scale;
  const float found2 =
      nearest_triangle(mesh.view(), p.data(), static_cast<float>(limit * limit)).distance2;
  return mesh.inside(at) ? 0 : std::min(most, scale * std::sqrt(double{found2}));
}

}  // namespace ist
