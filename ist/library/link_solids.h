#pragma once

#include <ist/asset.h>
#include <ist/cover_spheres.h>
#include <ist/query.h>
#include <Eigen/Geometry>

namespace ist {

class MeshSolid;

/// The solids of a robot's links, for exact tests of whether two of them overlap.
class LinkSolids {
 public:
  LinkSolids();
  ~LinkSolids();

  /// Adds a link: its closed mesh, if it has one, and spheres of its description. `read`: the mesh
  /// before it was closed, or nothing; what the closed one lacks of it, such as sheets that repair
  /// dropped, belongs to the link too. Returns why no exact query can be asked of it; "" if one
  /// can.
  std::string add(const ClosedMesh* mesh, std::span<const CoverSphere> spheres,
                  const TriangleMesh& read = {});

  /// By links in the order of add(): true if they share a volume above 0, or if a link has no exact
  /// solid. Thread-safe.
  bool overlap(std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) const;

  /// [u] Distance of their surfaces; 0 if a link has no exact solid. Thread-safe.
  double gap(std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) const;

  /// [u] From a point in the link's frame to the link, or `most` if that is less; 0 inside, and if
  /// it has no exact solid. To float rounding. Thread-safe.
  double distance(std::size_t link, const Eigen::Vector3d& point, double most) const;

 private:
  struct Workspaces;
  std::vector<std::unique_ptr<const Asset>> assets_;      ///< null: no exact solid
  std::vector<std::unique_ptr<const MeshSolid>> meshes_;  ///< the same
  std::unique_ptr<Workspaces> workspaces_;
};

}  // namespace ist
