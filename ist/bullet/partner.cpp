#include "bullet/partner.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ist/bullet/convert.h>

namespace ist::bullet {

namespace {

/// Turns the z axis into the axis of that number, right-handed.
btTransform from_z_to(int axis) {
  btMatrix3x3 turn(0, 0, 0, 0, 0, 0, 0, 0, 0);
  for (int k = 0; k < 3; ++k) turn[(axis + 1 + k) % 3][k] = 1;
  return btTransform(turn);
}

/// The nearest point of the segment from a to b.
template <class Vector>
Vector on_segment(const Vector& x, const Vector& a, const Vector& b) {
  const Vector along = b - a;
  return a + std::clamp((x - a).dot(along) / along.squaredNorm(), 0.0, 1.0) * along;
}

/// A cone about the z axis, its base below: in the half-plane of distance from the axis and height.
FieldSample look_at_cone(const void* context, const Eigen::Vector3d& x) noexcept {
  const auto& cone = *static_cast<const btConeShape*>(context);
  const double radius = cone.getRadius(), height = cone.getHeight();
  const double out = std::hypot(x.x(), x.y());
  const Eigen::Vector2d point(out, x.z()), apex(0, height / 2), foot(0, -height / 2);
  const Eigen::Vector2d rim(radius, -height / 2);
  const Eigen::Vector2d side = Eigen::Vector2d(height, radius).normalized();  // outward
  const double to_side = side.dot(apex - point), to_base = x.z() + height / 2;
  FieldSample sample;
  Eigen::Vector2d gradient;
  if (to_side >= 0 && to_base >= 0) {
    sample.distance = std::min(to_side, to_base);
    gradient = to_side < to_base ? Eigen::Vector2d(-side) : Eigen::Vector2d(0, 1);
  } else {
    const Eigen::Vector2d base = on_segment(point, foot, rim) - point;
    const Eigen::Vector2d mantle = on_segment(point, rim, apex) - point;
    gradient = base.squaredNorm() < mantle.squaredNorm() ? base : mantle;
    const double distance = gradient.norm();
    sample.distance = -distance;
    gradient = distance > 0 ? Eigen::Vector2d(gradient / distance) : Eigen::Vector2d(-side);
  }
  const Eigen::Vector2d radial =
      out > 0 ? Eigen::Vector2d(x.head<2>() / out) : Eigen::Vector2d(1, 0);
  sample.gradient << gradient.x() * radial, gradient.y();
  return sample;
}

FieldSample look_at_hull(const void* context, const Eigen::Vector3d& x) noexcept {
  return static_cast<const HullDistance*>(context)->at(x);
}

/// Bullet tells nobody what its terrain is made of: an heir may look.
struct Terrain : btHeightfieldTerrainShape {
  static bool find(const btHeightfieldTerrainShape& shape, PlacedField& placed, btVector3& origin) {
    if (shape.*(&Terrain::m_upAxis) != 2 || shape.*(&Terrain::m_heightDataType) != PHY_FLOAT) {
      return false;
    }
    const btVector3& scaling = shape.getLocalScaling();
    HeightField field;
    field.heights = shape.*(&Terrain::m_heightfieldDataFloat);
    field.columns = static_cast<std::uint32_t>(shape.*(&Terrain::m_heightStickWidth));
    field.rows = static_cast<std::uint32_t>(shape.*(&Terrain::m_heightStickLength));
    for (int k = 0; k < 2; ++k) field.spacing[k] = double{scaling[k]} / scaling.z();
    field.lowest = shape.*(&Terrain::m_minHeight);
    field.highest = shape.*(&Terrain::m_maxHeight);
    placed.field = field;
    placed.scale = scaling.z();
    // Bullet's is centred, ist's begins at the first height's foot.
    origin = -scaling * (shape.*(&Terrain::m_localOrigin));
    return true;
  }
};

}  // namespace

HullDistance::HullDistance(const std::vector<btVector3>& points) {
  btConvexHullComputer hull;
  if (points.empty()) return;
  hull.compute(&points[0][0], sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
  for (int f = 0; f < hull.faces.size(); ++f) {
    Face face{Eigen::Vector3d::Zero(), 0, {}};
    const btConvexHullComputer::Edge* const first = &hull.edges[hull.faces[f]];
    const btConvexHullComputer::Edge* edge = first;
    do {
      face.corners.push_back(to_eigen(hull.vertices[edge->getSourceVertex()]));
      edge = edge->getNextEdgeOfFace();
    } while (edge != first);
    const std::size_t count = face.corners.size();
    for (std::size_t i = 0; i < count; ++i) {
      face.normal += (face.corners[i] - face.corners[0])
                         .cross(face.corners[(i + 1) % count] - face.corners[0]);
    }
    face.normal.normalize();
    for (const Eigen::Vector3d& c : face.corners)
      face.offset += face.normal.dot(c) / static_cast<double>(count);
    faces_.push_back(std::move(face));
  }
}

FieldSample HullDistance::at(const Eigen::Vector3d& x) const noexcept {
  FieldSample inside{std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (const Face& face : faces_) {
    const double out = face.normal.dot(x) - face.offset;
    if (-out < inside.distance) inside = {-out, -face.normal};
    if (out <= 0) continue;
    bool over = true;
    const std::size_t count = face.corners.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& a = face.corners[i];
      const Eigen::Vector3d& b = face.corners[(i + 1) % count];
      if ((b - a).cross(face.normal).dot(x - a) <= 0) continue;
      over = false;
      const Eigen::Vector3d to_edge = on_segment(x, a, b) - x;
      if (to_edge.norm() < nearest) nearest = to_edge.norm(), way = to_edge / nearest;
    }
    if (over && out < nearest) nearest = out, way = -face.normal;
  }
  if (inside.distance >= 0) return inside;
  return {-nearest, way};
}

std::optional<Partner> Partner::of(const btCollisionShape& shape) {
  Partner partner;
  switch (shape.getShapeType()) {
    case STATIC_PLANE_PROXYTYPE: {
      const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
      partner.field_.field =
          HalfSpaceField{to_eigen(plane.getPlaneNormal()), plane.getPlaneConstant()};
      return partner;
    }
    case BOX_SHAPE_PROXYTYPE:
      partner.field_.field =
          BoxField{to_eigen(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin())};
      return partner;
    case SPHERE_SHAPE_PROXYTYPE:
      partner.field_.field = BallField{static_cast<const btSphereShape&>(shape).getRadius()};
      return partner;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      partner.field_.field = CapsuleField{capsule.getRadius(), capsule.getHalfHeight()};
      partner.in_shape_ = from_z_to(capsule.getUpAxis());
      return partner;
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      const int up = cylinder.getUpAxis();
      partner.field_.field =
          CylinderField{cylinder.getRadius(), cylinder.getHalfExtentsWithMargin()[up]};
      partner.in_shape_ = from_z_to(up);
      return partner;
    }
    case CONE_SHAPE_PROXYTYPE:
      partner.field_.field = FunctionField{look_at_cone, &shape, 0};
      partner.in_shape_ = from_z_to(static_cast<const btConeShape&>(shape).getConeUpIndex());
      return partner;
    case CONVEX_HULL_SHAPE_PROXYTYPE:
    case TETRAHEDRAL_SHAPE_PROXYTYPE:
    case CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE:
    case CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE: {
      const auto& polyhedron = static_cast<const btPolyhedralConvexShape&>(shape);
      std::vector<btVector3> points(static_cast<std::size_t>(polyhedron.getNumVertices()));
      for (std::size_t i = 0; i < points.size(); ++i) {
        polyhedron.getVertex(static_cast<int>(i), points[i]);
      }
      partner.hull_ = std::make_shared<const HullDistance>(points);
      if (partner.hull_->faces() < 4) return std::nullopt;
      partner.field_.field = FunctionField{look_at_hull, partner.hull_.get(), 0};
      return partner;
    }
    case TERRAIN_SHAPE_PROXYTYPE: {
      btVector3 origin;
      if (!Terrain::find(static_cast<const btHeightfieldTerrainShape&>(shape), partner.field_,
                         origin)) {
        return std::nullopt;
      }
      partner.in_shape_.setOrigin(origin);
      return partner;
    }
    default:
      return std::nullopt;
  }
}

PlacedField Partner::placed(const btTransform& shape) const {
  PlacedField placed = field_;
  placed.pose = to_pose(shape * in_shape_);
  return placed;
}

}  // namespace ist::bullet
