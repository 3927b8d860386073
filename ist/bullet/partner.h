#pragma once

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <LinearMath/btTransform.h>

#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <ist/bullet/shape.h>
#include <ist/contact_law.h>
#include <ist/query.h>

namespace ist::bullet {

/// Points relative to a convex hull by its faces: exact inside and outside.
class HullDistance {
 public:
  /// With fewer than four faces it is flat, not a solid.
  explicit HullDistance(const std::vector<btVector3>& points);

  std::size_t faces() const { return faces_.size(); }
  ShapeSample at(const Eigen::Vector3d& x) const noexcept;
  void add_faces(const Eigen::Isometry3d& pose, bool of_b, SupportPolygon& polygon) const;

 private:
  struct Face {
    Eigen::Vector3d normal;                // outward
    double offset;                         // normal · x on it
    std::vector<Eigen::Vector3d> corners;  // anticlockwise, seen from outside
  };
  std::vector<Face> faces_;
};

/// A triangle mesh near a body, as a solid: everything behind the front of its nearest triangle, to
/// a depth. The front is the side from which corners run anticlockwise.
class MeshDistance : public btTriangleCallback {
 public:
  /// Takes the triangles of the shape that reach into the box, in the shape's frame, grown by
  /// `thickness` > 0 [u].
  void gather(const btConcaveShape& shape, const btVector3& lower, const btVector3& upper,
              double thickness);

  ShapeSample at(const Eigen::Vector3d& x) const noexcept;
  void add_faces(const Eigen::Isometry3d& pose, bool of_b, SupportPolygon& polygon) const;

 private:
  struct Triangle {
    Eigen::Vector3d nearest(const Eigen::Vector3d& x) const;

    Eigen::Vector3d corner[3], normal, centre;
    double area, reach = 0;  // [u²] twice its own; [u] of a corner from the centre
  };
  void processTriangle(btVector3* corners, int part, int index) override;
  /// True if all triangles lie in one plane and cover the area under a box.
  bool is_level(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) const;

  static constexpr std::size_t kBlock =
      8;  // consecutive triangles, in the order of the shape's tree
  std::vector<Triangle> triangles_;
  std::vector<Eigen::AlignedBox3d> boxes_;  // of blocks
  double thickness_ = 0;
  int up_ = -1;  // of a height field: the axis that its front faces
  bool mirrored_ = false;
  bool level_ = false;  // near the body, in the first triangle's plane
};

/// A collision partner that is not an asset: a shape of Bullet's as a shape in its own frame.
/// Bullet's shape must outlive it and must not change meanwhile.
class Partner {
 public:
  static std::optional<Partner> of(const btCollisionShape& shape);

  /// For an asset in a box in the shape's frame: see MeshDistance::gather(). Triangles last until
  /// the thread's next call.
  PlacedShape placed(const btTransform& shape, const btVector3& lower, const btVector3& upper,
                     double thickness) const;

  /// [u] The distances of placed() are valid for motions up to this.
  double clearance(double thickness) const {
    return mesh_ != nullptr ? thickness : std::numeric_limits<double>::infinity();
  }

  /// Adds its flat faces, if SupportPolygon::add() does not know them. `placed`: from placed(), in
  /// the same thread and before its next call.
  void add_faces(const PlacedShape& placed, bool of_b, SupportPolygon& polygon) const;

  const btCollisionShape& shape() const { return *shape_; }

 private:
  explicit Partner(const btCollisionShape& shape) : shape_(&shape) {}

  const btCollisionShape* shape_;
  PlacedShape field_;  // its pose is in_shape_, each time
  btTransform in_shape_ = btTransform::getIdentity();
  std::shared_ptr<const HullDistance> hull_;
  const btConcaveShape* mesh_ = nullptr;
};

}  // namespace ist::bullet
