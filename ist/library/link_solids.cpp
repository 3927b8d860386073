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
#include "robots/covers/triangles.h"
#include "robots/description/link_mesh.h"

namespace ist {
namespace {

constexpr double kLacking = 1e-3;          ///< of the size: what is so near is a part of a solid
constexpr double kThin = 1e-5;             ///< of the size
constexpr double kFineness = 0.02;         ///< of the size, of places that are looked at
constexpr std::size_t kMostLacking = 500;  ///< triangles

double distance_to(const MeshSolid& mesh, const Eigen::Vector3d& point, double most) {
  if (mesh.bounds().squaredExteriorDistance(point) >= most * most) return most;
  const Eigen::Vector3d at = mesh.frame().to_unit(point);
  const Eigen::Vector3f p = at.cast<float>();
  const double scale = mesh.frame().scale(), limit = most / scale;
  const float found2 =
      nearest_triangle(mesh.view(), p.data(), static_cast<float>(limit * limit)).distance2;
  return mesh.inside(at) ? 0 : std::min(most, scale * std::sqrt(double{found2}));
}

bool lies_outside(const MeshSolid& solid, const HalvableTriangle& t, double size) {
  const double most = kLacking * size;
  if (distance_to(solid, (t[0] + t[1] + t[2]) / 3, most) >= most) return true;
  const LongestSide side = longest_side(t);
  if (!(side.length2 > kFineness * size * kFineness * size)) return false;
  const auto parts = halves(t, side.from);
  return lies_outside(solid, parts[0], size) || lies_outside(solid, parts[1], size);
}

/// Thin prisms around the triangles of a mesh that do not lie in a solid.
TriangleMesh lacking(const TriangleMesh& read, const ClosedMesh& mesh) {
  TriangleMesh out;
  if (read.triangles.empty()) return out;
  const MeshSolid solid(mesh);
  Eigen::AlignedBox3d box;
  for (const auto& t : read.triangles)
    for (const std::uint32_t v : t) box.extend(read.vertices[v]);
  const double size = box.diagonal().norm();
  for (const auto& v : read.triangles) {
    const HalvableTriangle t = {read.vertices[v[0]], read.vertices[v[1]], read.vertices[v[2]]};
    const Eigen::Vector3d across = (t[1] - t[0]).cross(t[2] - t[0]);
    if (!(across.norm() > 0) || !lies_outside(solid, t, size)) continue;
    if (out.triangles.size() >= 8 * kMostLacking)
      throw Error("more than " + std::to_string(kMostLacking) +
                  " triangles are in no solid that it was closed to");
    const Eigen::Vector3d up = kThin * size * across.normalized();
    TriangleMesh prism;
    for (const Eigen::Vector3d& off : {Eigen::Vector3d(-up), up})
      for (const Eigen::Vector3d& corner : t) prism.vertices.push_back(corner + off);
    prism.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                       {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    append_mesh(out, prism);
  }
  return out;
}

}  // namespace

struct LinkSolids::Workspaces {
  tbb::enumerable_thread_specific<Workspace> each;
};

LinkSolids::LinkSolids() : workspaces_(std::make_unique<Workspaces>()) {}
LinkSolids::~LinkSolids() = default;

std::string LinkSolids::add(const ClosedMesh* mesh, std::span<const CoverSphere> spheres,
                            const TriangleMesh& read) {
  assets_.emplace_back();
  meshes_.emplace_back();
  try {
    ClosedMesh all = mesh == nullptr ? ClosedMesh{} : *mesh;
    const std::size_t own = all.mesh.triangles.size();
    if (mesh != nullptr) append_mesh(all.mesh, lacking(read, *mesh));
    for (const CoverSphere& s : spheres)
      append_mesh(all.mesh, capsule_mesh({s.centre, s.centre, s.radius}).mesh);
    if (all.mesh.triangles.size() != own) all = close_mesh(std::move(all.mesh), "link");
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
  return distance_to(*meshes_[link], point, most);
}

}  // namespace ist
