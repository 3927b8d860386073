#pragma once

// FCL on triangle meshes (cmake/peers.cmake: ist_peer_fcl). What to know of it:
// - A mesh is its surface: a mesh wholly inside another is neither in contact nor at distance 0.
// - BVH models know no scale; it goes into the vertices.
// - distance() is exact only while DistanceRequest keeps rel_err = abs_err = 0, its defaults.

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include <ist/mesh.h>
#include <ist/pose_eigen.h>

#include "support/mesh_contacts.h"

namespace ist::testing {

/// A mesh as FCL sees it, scaled about its own origin. Immutable.
class FclMesh {
 public:
  explicit FclMesh(const TriangleMesh& mesh, double scale = 1)
      : model_(std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>()) {
    std::vector<fcl::Vector3d> vertices;
    for (const Eigen::Vector3d& v : mesh.vertices) vertices.push_back(scale * v);
    std::vector<fcl::Triangle> triangles;
    for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    const bool built = model_->beginModel() == fcl::BVH_OK &&
                       model_->addSubModel(vertices, triangles) == fcl::BVH_OK &&
                       model_->endModel() == fcl::BVH_OK;
    if (!built) throw std::runtime_error("FCL refuses the mesh");
  }

  const fcl::BVHModel<fcl::OBBRSSd>* model() const { return model_.get(); }

 private:
  std::shared_ptr<fcl::BVHModel<fcl::OBBRSSd>> model_;
};

/// Do the surfaces cross? Stops at the first contact.
inline bool fcl_in_contact(const FclMesh& a, const Pose& pose_a, const FclMesh& b,
                           const Pose& pose_b) {
  fcl::CollisionResultd result;
  return fcl::collide(a.model(), to_isometry(pose_a), b.model(), to_isometry(pose_b),
                      fcl::CollisionRequestd(1, false), result) > 0;
}

/// Every contact, with normals and depths.
inline MeshContacts fcl_contacts(const FclMesh& a, const Pose& pose_a, const FclMesh& b,
                                 const Pose& pose_b) {
  fcl::CollisionResultd result;
  fcl::collide(a.model(), to_isometry(pose_a), b.model(), to_isometry(pose_b),
               fcl::CollisionRequestd(std::numeric_limits<int>::max(), true), result);
  MeshContacts sum;
  sum.count = result.numContacts();
  for (std::size_t i = 0; i < sum.count; ++i) {
    const fcl::Contactd& contact = result.getContact(i);
    const double depth = std::max(0.0, contact.penetration_depth);
    sum.depth_sum += depth;
    sum.push_b += depth * contact.normal;  // FCL's normal points from A to B
  }
  return sum;
}

/// [u] distance of the surfaces; 0 where they cross.
inline double fcl_distance(const FclMesh& a, const Pose& pose_a, const FclMesh& b,
                           const Pose& pose_b) {
  fcl::DistanceResultd result;
  fcl::distance(a.model(), to_isometry(pose_a), b.model(), to_isometry(pose_b),
                fcl::DistanceRequestd(), result);
  return std::max(0.0, result.min_distance);
}

}  // namespace ist::testing
