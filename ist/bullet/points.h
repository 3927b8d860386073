#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <array>
#include <vector>

#include "bullet/meeting.h"

namespace ist::bullet {

/// The point at which a patch pushes. A force on the wrench's axis leaves only the torque about the
/// axis. If a patch pushes in both directions the axis may be far away, so the point stays within
/// the patch's width of its middle.
Eigen::Vector3d place_of(const ContactPatch& patch);

/// The points of a pair in Bullet's manifolds.
class Points {
 public:
  /// Moves the points with the bodies.
  void move(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b, double step);
  /// Replaces the points by those of a contact. Reports the beginning or end of a contact.
  void fill(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
            const Contact& contact, const Spring& spring, btDispatcher& dispatcher);
  std::size_t count() const;
  /// The first manifold; created if there is none.
  btPersistentManifold* first_manifold(const btCollisionObject& first,
                                       const btCollisionObject& second, btDispatcher& dispatcher);
  void release(btDispatcher& dispatcher);

  std::array<Unsaid, 2> unsaid;
  std::vector<btPersistentManifold*> manifolds;  // the first ones are full

 private:
  /// [u/s] Bound of the speed at which the contact may separate the bodies, in the direction in
  /// which all points push.
  Eigen::Vector3d together(const btCollisionObject& first, const btCollisionObject& second,
                           const Contact& contact, const Spring& spring);
  void set_spring(btManifoldPoint& point, const ContactPatch& patch, const Spring& spring,
                  const Eigen::Vector3d& together) const;
  btVector3 unsaid_at(const btVector3& x) const { return unsaid[0].at(x) - unsaid[1].at(x); }

  std::array<btVector3, Settings::kPatches> normals_;    // of all points, in the first's frame
  std::array<btVector3, Settings::kPatches> frictions_;  // of all points in the step before
  double closing_ = 0;  // [u/s] of an impact, forgotten as the bodies separate
};

}  // namespace ist::bullet
