#include "library/link_solids.h"

#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/types.h>
#include <tbb/enumerable_thread_specific.h>

#include <utility>

#include "robot/link_mesh.h"

namespace ist {

struct LinkSolids::Workspaces {
  tbb::enumerable_thread_specific<Workspace> each;
};

LinkSolids::LinkSolids() : workspaces_(std::make_unique<Workspaces>()) {}
LinkSolids::~LinkSolids() = default;

std::string LinkSolids::add(const ClosedMesh* mesh, std::span<const CoverSphere> spheres) {
  assets_.emplace_back();
  try {
    if (spheres.empty()) {
      assets_.back() = std::make_unique<const Asset>(bake_mesh_only(*mesh));
      return "";
    }
    TriangleMesh all = mesh == nullptr ? TriangleMesh{} : mesh->mesh;
    for (const CoverSphere& s : spheres)
      append_mesh(all, capsule_mesh({s.centre, s.centre, s.radius}).mesh);
    assets_.back() =
        std::make_unique<const Asset>(bake_mesh_only(close_mesh(std::move(all), "link")));
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

bool LinkSolids::overlap(std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) const {
  if (!assets_[a] || !assets_[b]) return true;
  PenetrationSettings exact;
  exact.measure = Measure::exact;
  const Penetration found = penetration(PlacedSolid(assets_[a]->view(), Pose{}),
                                        PlacedSolid(assets_[b]->view(), to_pose(b_in_a)), exact,
                                        workspaces_->each.local());
  return found.status != QueryStatus::ok || found.volume_min > 0;
}

}  // namespace ist
