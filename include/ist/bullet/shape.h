#pragma once

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <Eigen/Geometry>

#include <ist/asset.h>

namespace ist::bullet {

class Contacts;

/// Bullet's body frame of a baked solid: at its centre of mass, along principal axes: the asset's
/// own axes if those are principal.
struct BodyFrame {
  Eigen::Isometry3d in_mesh = Eigen::Isometry3d::Identity();  ///< body's frame to mesh's
  Eigen::Vector3d unit_inertia = Eigen::Vector3d::Zero();  ///< [u²] about its axes, of a mass of 1
};
BodyFrame body_frame(const AssetView& tree);

/// A baked solid as a collision shape of Bullet, for Contacts. The asset's bytes must outlive it.
///
/// Bullet turns bodies about their own origin and expects principal axes there: the body's
/// transform is that of body_frame(), not the mesh's.
class Shape : public btConcaveShape {
 public:
  explicit Shape(const AssetView& tree);

  const AssetView& tree() const { return tree_; }
  const btTransform& mesh_in_body() const { return mesh_in_body_; }
  double scale() const { return scale_; }
  double reach() const { return scale_ * reach_; }  ///< [u] bounding radius about the origin
  double volume() const { return scale_ * scale_ * scale_ * tree_.volume(); }  ///< [u³]

  /// [force/u³] Pressure over depth of its material: see Settings::law. 0: not known.
  double stiffness = 0;

  void getAabb(const btTransform& t, btVector3& lower, btVector3& upper) const override;
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  const char* getName() const override { return "ist::bullet::Shape"; }
  void setMargin(btScalar) override {}  // a volume needs no margin
  btScalar getMargin() const override { return 0; }

  /// One positive factor for all axes; another one is refused by warn() and changes nothing.
  void setLocalScaling(const btVector3& scaling) override;
  const btVector3& getLocalScaling() const override { return scaling_; }

  /// Gives Bullet's sweeps and debug drawing the triangles of the kept mesh (AssetView::has_mesh),
  /// all of them in turn, and its rays those that they hit, by raycast() of <ist/raycast.h>.
  /// Without a mesh there are none, and warn() says so.
  void processAllTriangles(btTriangleCallback* callback, const btVector3& lower,
                           const btVector3& upper) const override;

 private:
  AssetView tree_;
  BodyFrame frame_;
  btTransform mesh_in_body_;
  double scale_ = 1, reach_ = 0;
  btVector3 lower_, upper_;  // in the body's frame, of scale 1
  btVector3 scaling_{1, 1, 1};
};

/// Called once in each world (Contacts) for each kind of shape or setting that is not supported,
/// with a sentence that names it. Called on any thread that makes pairs. The default writes to
/// stderr.
using WarningHandler = void (*)(const char* sentence);

/// Replaces the handler; null: the default. Returns the previous one.
WarningHandler set_warning_handler(WarningHandler handler);

/// Passes a sentence to the handler, unless the same sentence was passed before in the same world,
/// or outside of worlds.
void warn(const char* sentence, const Contacts* world = nullptr);

}  // namespace ist::bullet
