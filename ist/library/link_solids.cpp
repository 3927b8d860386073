#include "library/link_solids.h"

#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/raycast.h>
#include <tbb/enumerable_thread_specific.h>
#include <algorithm>
#include <utility>

#include "robots/description/link_mesh.h"

namespace ist {

struct LinkSolids::Workspaces {
  tbb::enumerable_thread_specific<Workspace> each;
};

LinkSolids::LinkSolids() : workspaces_(std::make_unique<Workspaces>()) {}
LinkSolids::~LinkSolids() = default;

std::string LinkSolids::add(const ClosedMesh* mesh, std::span<const CoverSphere> spheres) {
  assets_.emplace_back();
  TriangleMesh all = mesh == nullptr ? TriangleMesh{} : mesh->mesh;
  for (const CoverSphere& s : spheres)
    append_mesh(all, capsule_mesh({s.centre, s.centre, s.radius}).mesh);
  boxes_.emplace_back();
  for (const Eigen::Vector3d& v : all.vertices) boxes_.back().extend(v);
  try {
    if (spheres.empty()) {
      assets_.back() = std::make_unique<const Asset>(bake_mesh_only(*mesh));
      return "";
    }
    assets_.back() =
        std::make_unique<const Asset>(bake_mesh_only(close_mesh(std::move(all), "link")));
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
  if (!assets_[link]) return 0;
  if (boxes_[link].squaredExteriorDistance(point) >= most * most) return most;
  const double found = closest_point(PlacedSolid(assets_[link]->view(), Pose{}), point).distance;
  return std::clamp(found, 0.0, most);
}

}  // namespace ist
