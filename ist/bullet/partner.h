#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btTransform.h>

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include <ist/bullet/shape.h>
#include <ist/query.h>

namespace ist::bullet {

/// Points of a convex hull by its faces: exact inside and outside.
class HullDistance {
 public:
  /// Fewer than four faces: it is flat, and no solid.
  explicit HullDistance(const std::vector<btVector3>& points);

  std::size_t faces() const { return faces_.size(); }
  FieldSample at(const Eigen::Vector3d& x) const noexcept;

 private:
  struct Face {
    Eigen::Vector3d normal;                // outward
    double offset;                         // normal · x on it
    std::vector<Eigen::Vector3d> corners;  // anticlockwise, seen from outside
  };
  std::vector<Face> faces_;
};

/// What an asset meets that is none: a shape of Bullet's as a field in the shape's frame. The shape
/// must outlive it, and must not be changed meanwhile.
class Partner {
 public:
  static std::optional<Partner> of(const btCollisionShape& shape);

  PlacedField placed(const btTransform& shape) const;

 private:
  PlacedField field_;  // its pose is in_shape_, each time
  btTransform in_shape_ = btTransform::getIdentity();
  std::shared_ptr<const HullDistance> hull_;
};

}  // namespace ist::bullet
