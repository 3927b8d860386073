#pragma once

// Bullet's GImpact on triangle meshes, in double (cmake/peers.cmake: ist_peer_bullet). What to
// know:
// - BT_USE_DOUBLE_PRECISION must match the library; a mismatch compiles and reads garbage.
// - updateBound() builds the BVH; without it there are no contacts. setMargin() comes before it.
// - A margin is a skin around the triangles (0.01 [u] by default: 1 % of an object of size 1);
//   it is 0 here.
// - A persistent manifold keeps 4 points; all contacts are gathered from btManifoldResult instead.
// - A mesh is its surface: an object wholly inside another is not in contact.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <memory>
#include <vector>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/mesh_contacts.h"

namespace ist::testing {

static_assert(sizeof(btScalar) == sizeof(double), "Bullet must be its double-precision build");

inline btTransform bullet_transform(const Pose& pose) {
  const btQuaternion q(pose.q[1], pose.q[2], pose.q[3], pose.q[0]);
  return btTransform(q.normalized(), btVector3(pose.t[0], pose.t[1], pose.t[2]));
}

/// A mesh as Bullet sees it, scaled about its own origin. Bullet locks the shape during a query:
/// one thread at a time.
class BulletMesh {
 public:
  explicit BulletMesh(const TriangleMesh& mesh, double scale = 1) {
    for (const Eigen::Vector3d& v : mesh.vertices) {
      for (int k = 0; k < 3; ++k) coordinates_.push_back(scale * v[k]);
    }
    for (const auto& t : mesh.triangles) {
      for (const std::uint32_t index : t) indices_.push_back(static_cast<int>(index));
    }
    triangles_ = std::make_unique<btTriangleIndexVertexArray>(
        static_cast<int>(indices_.size() / 3), indices_.data(), static_cast<int>(3 * sizeof(int)),
        static_cast<int>(coordinates_.size() / 3), coordinates_.data(),
        static_cast<int>(3 * sizeof(double)));
    shape_ = std::make_unique<btGImpactMeshShape>(triangles_.get());
    shape_->setMargin(0);
    shape_->updateBound();
    object_.setCollisionShape(shape_.get());
  }

  btCollisionObject& at(const Pose& pose) {
    object_.setWorldTransform(bullet_transform(pose));
    return object_;
  }
  btGImpactMeshShape* shape() const { return shape_.get(); }

 private:
  std::vector<double> coordinates_;
  std::vector<int> indices_;
  std::unique_ptr<btTriangleIndexVertexArray> triangles_;
  std::unique_ptr<btGImpactMeshShape> shape_;
  btCollisionObject object_;
};

/// Bullet's narrow phase for pairs of BulletMesh; make one, use it for many queries.
class BulletNarrowPhase {
 public:
  BulletNarrowPhase() : dispatcher_(&configuration_) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
  }

  /// Every contact, with normals and depths.
  MeshContacts contacts(BulletMesh& a, const Pose& pose_a, BulletMesh& b, const Pose& pose_b) {
    return contacts(a.at(pose_a), b.at(pose_b));
  }

  /// The same for objects of any shape.
  MeshContacts contacts(const btCollisionObject& object_a, const btCollisionObject& object_b) {
    const btCollisionObjectWrapper wrap_a(nullptr, object_a.getCollisionShape(), &object_a,
                                          object_a.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper wrap_b(nullptr, object_b.getCollisionShape(), &object_b,
                                          object_b.getWorldTransform(), -1, -1);
    btCollisionAlgorithm* const algorithm =
        dispatcher_.findAlgorithm(&wrap_a, &wrap_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    Gather gather(&wrap_a, &wrap_b);
    algorithm->processCollision(&wrap_a, &wrap_b, info_, &gather);
    algorithm->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm);
    return gather.sum;
  }

 private:
  struct Gather final : btManifoldResult {
    using btManifoldResult::btManifoldResult;
    void addContactPoint(const btVector3& normal_on_b, const btVector3&, btScalar gap) override {
      const double depth = std::max(0.0, -gap);
      ++sum.count;
      sum.depth_sum += depth;
      // Bullet's normal points from B to A.
      sum.push_b -= depth * Eigen::Vector3d(normal_on_b.x(), normal_on_b.y(), normal_on_b.z());
    }
    MeshContacts sum;
  };

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDispatcherInfo info_;
};

}  // namespace ist::testing
