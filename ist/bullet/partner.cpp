#include "bullet/partner.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <ist/bullet/convert.h>
#include <ist/pose_eigen.h>

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

/// A cone about the z axis, with its base below, in the half-plane of distance from the axis and
/// height.
ShapeSample cone_sample(const void* context, const Eigen::Vector3d& x) noexcept {
  const auto& cone = *static_cast<const btConeShape*>(context);
  const double radius = cone.getRadius(), height = cone.getHeight();
  const double out = std::hypot(x.x(), x.y());
  const Eigen::Vector2d point(out, x.z()), apex(0, height / 2), foot(0, -height / 2);
  const Eigen::Vector2d rim(radius, -height / 2);
  const Eigen::Vector2d side = Eigen::Vector2d(height, radius).normalized();  // outward
  const double to_side = side.dot(apex - point), to_base = x.z() + height / 2;
  ShapeSample sample;
  Eigen::Vector2d gradient;
  if (to_side >= 0 && to_base >= 0) {
    sample.distance = -std::min(to_side, to_base);
    gradient = to_side < to_base ? side : Eigen::Vector2d(0, -1);
  } else {
    const Eigen::Vector2d base = point - on_segment(point, foot, rim);
    const Eigen::Vector2d mantle = point - on_segment(point, rim, apex);
    gradient = base.squaredNorm() < mantle.squaredNorm() ? base : mantle;
    const double distance = gradient.norm();
    sample.distance = distance;
    gradient = distance > 0 ? Eigen::Vector2d(gradient / distance) : side;
  }
  const Eigen::Vector2d radial =
      out > 0 ? Eigen::Vector2d(x.head<2>() / out) : Eigen::Vector2d(1, 0);
  sample.gradient << gradient.x() * radial, gradient.y();
  return sample;
}

ShapeSample mesh_sample(const void* context, const Eigen::Vector3d& x) noexcept {
  return static_cast<const MeshDistance*>(context)->at(x);
}

ShapeSample hull_sample(const void* context, const Eigen::Vector3d& x) noexcept {
  return static_cast<const HullDistance*>(context)->at(x);
}

std::vector<btVector3> corners_of(const btPolyhedralConvexShape& shape) {
  if (shape.getShapeType() == CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE) {
    // The callback does not count corners. Triangles are already scaled by the mesh, like its
    // support.
    struct Corners : btInternalTriangleIndexCallback {
      std::vector<btVector3> all;
      void internalProcessTriangleIndex(btVector3* corners, int, int) override {
        all.insert(all.end(), corners, corners + 3);
      }
    } corners;
    const btVector3 none(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
    static_cast<const btConvexTriangleMeshShape&>(shape)
        .getMeshInterface()
        ->InternalProcessAllTriangles(&corners, -none, none);
    return corners.all;
  }
  std::vector<btVector3> corners(static_cast<std::size_t>(shape.getNumVertices()));
  for (std::size_t i = 0; i < corners.size(); ++i) shape.getVertex(static_cast<int>(i), corners[i]);
  return corners;
}

/// Bullet does not expose the data of its terrain, except to derived classes.
struct Terrain : btHeightfieldTerrainShape {
  static bool find(const btHeightfieldTerrainShape& shape, PlacedShape& placed, btVector3& origin) {
    if (shape.*(&Terrain::m_upAxis) != 2 || shape.*(&Terrain::m_heightDataType) != PHY_FLOAT) {
      return false;
    }
    const btVector3& scaling = shape.getLocalScaling();
    HeightFieldShape field;
    field.heights = shape.*(&Terrain::m_heightfieldDataFloat);
    field.columns = static_cast<std::uint32_t>(shape.*(&Terrain::m_heightStickWidth));
    field.rows = static_cast<std::uint32_t>(shape.*(&Terrain::m_heightStickLength));
    for (int k = 0; k < 2; ++k) field.spacing[k] = double{scaling[k]} / scaling.z();
    field.lowest = shape.*(&Terrain::m_minHeight);
    field.highest = shape.*(&Terrain::m_maxHeight);
    placed.shape = field;
    placed.scale = scaling.z();
    // Bullet's terrain is centred, ours begins below the first height.
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

ShapeSample HullDistance::at(const Eigen::Vector3d& x) const noexcept {
  ShapeSample inside{-std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
  for (const Face& face : faces_) {
    const double out = face.normal.dot(x) - face.offset;
    if (out > inside.distance) inside = {out, face.normal};
    if (out <= 0) continue;
    bool over = true;
    const std::size_t count = face.corners.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& a = face.corners[i];
      const Eigen::Vector3d& b = face.corners[(i + 1) % count];
      if ((b - a).cross(face.normal).dot(x - a) <= 0) continue;
      over = false;
      const Eigen::Vector3d from_edge = x - on_segment(x, a, b);
      if (from_edge.norm() < nearest) nearest = from_edge.norm(), outward = from_edge / nearest;
    }
    if (over && out < nearest) nearest = out, outward = face.normal;
  }
  if (inside.distance <= 0) return inside;
  return {nearest, outward};
}

void HullDistance::add_faces(const Eigen::Isometry3d& pose, bool of_b,
                             SupportPolygon& polygon) const {
  for (const Face& face : faces_)
    for (std::size_t i = 2; i < face.corners.size(); ++i)
      polygon.add_triangle(of_b, pose * face.corners[0], pose * face.corners[i - 1],
                           pose * face.corners[i]);
}

void MeshDistance::add_faces(const Eigen::Isometry3d& pose, bool of_b,
                             SupportPolygon& polygon) const {
  for (const Triangle& triangle : triangles_)
    polygon.add_triangle(of_b, pose * triangle.corner[0], pose * triangle.corner[1],
                         pose * triangle.corner[2]);
}

void MeshDistance::gather(const btConcaveShape& shape, const btVector3& lower,
                          const btVector3& upper, double thickness) {
  triangles_.clear();
  boxes_.clear();
  thickness_ = thickness;
  const btVector3* scaling = &shape.getLocalScaling();
  mirrored_ = scaling->x() * scaling->y() * scaling->z() < 0;
  up_ = -1;
  if (shape.getShapeType() == SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE) {
    scaling =
        &static_cast<const btScaledBvhTriangleMeshShape&>(shape).getChildShape()->getLocalScaling();
    mirrored_ ^= scaling->x() * scaling->y() * scaling->z() < 0;
  } else if (shape.getShapeType() == TERRAIN_SHAPE_PROXYTYPE) {
    up_ = static_cast<const btHeightfieldTerrainShape&>(shape).getUpAxis();
    mirrored_ = (*scaling)[up_] < 0;
  }
  const auto grown = static_cast<btScalar>(thickness);
  shape.processAllTriangles(this, lower - btVector3(grown, grown, grown),
                            upper + btVector3(grown, grown, grown));
  level_ = is_level(to_eigen(lower), to_eigen(upper));
}

bool MeshDistance::is_level(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) const {
  if (triangles_.empty()) return false;
  const Triangle& first = triangles_[0];
  const Eigen::Vector3d middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
  const double same = 1e-12 * (half.norm() + middle.norm() + first.centre.norm());
  for (const Triangle& triangle : triangles_)
    if ((triangle.normal - first.normal).squaredNorm() > 1e-24 ||
        std::abs(first.normal.dot(triangle.centre - first.centre)) > same)
      return false;
  // The part of each triangle inside the rectangle under the box, clipped by its four sides.
  const Eigen::Vector3d axes[2] = {
      (first.corner[1] - first.corner[0]).normalized(),
      first.normal.cross(first.corner[1] - first.corner[0]).normalized()};
  const double reach[2] = {axes[0].cwiseAbs().dot(half), axes[1].cwiseAbs().dot(half)};
  double covered = 0;
  for (const Triangle& triangle : triangles_) {
    std::array<Eigen::Vector2d, 8> corners, clipped;
    std::size_t count = 3;
    for (std::size_t k = 0; k < 3; ++k)
      for (int i = 0; i < 2; ++i) corners[k][i] = axes[i].dot(triangle.corner[k] - middle);
    for (int side = 0; side < 4; ++side) {
      const auto inside = [&](const Eigen::Vector2d& x) {
        return reach[side / 2] - (side % 2 == 0 ? x[side / 2] : -x[side / 2]);
      };
      std::size_t kept = 0;
      for (std::size_t k = 0; k < count; ++k) {
        const Eigen::Vector2d &x = corners[k], &y = corners[(k + 1) % count];
        const double at_x = inside(x), at_y = inside(y);
        if (at_x >= 0) clipped[kept++] = x;
        if ((at_x >= 0) != (at_y >= 0)) clipped[kept++] = x + at_x / (at_x - at_y) * (y - x);
      }
      corners = clipped;
      count = kept;
    }
    for (std::size_t k = 2; k < count; ++k) {
      const Eigen::Vector2d x = corners[k - 1] - corners[0], y = corners[k] - corners[0];
      covered += 0.5 * (x[0] * y[1] - x[1] * y[0]);
    }
  }
  const double all = 4 * reach[0] * reach[1];
  return std::abs(covered - all) < 1e-9 * all;
}

void MeshDistance::processTriangle(btVector3* corners, int, int) {
  Triangle triangle;
  for (int k = 0; k < 3; ++k) triangle.corner[k] = to_eigen(corners[k]);
  const auto& [a, b, c] = triangle.corner;
  triangle.normal = (b - a).cross(c - a);
  triangle.area = triangle.normal.norm();
  if (!(triangle.area > 0)) return;
  triangle.normal /= triangle.area;
  if ((up_ >= 0 && triangle.normal[up_] < 0) != mirrored_) {
    std::swap(triangle.corner[1], triangle.corner[2]);
    triangle.normal *= -1;
  }
  triangle.centre = (a + b + c) / 3;
  for (const Eigen::Vector3d& corner : triangle.corner)
    triangle.reach = std::max(triangle.reach, (corner - triangle.centre).norm());
  if (triangles_.size() % kBlock == 0) boxes_.emplace_back();
  for (const Eigen::Vector3d& corner : triangle.corner) boxes_.back().extend(corner);
  triangles_.push_back(triangle);
}

/// The nearest point of a triangle as shares of its corners.
Eigen::Vector3d MeshDistance::Triangle::nearest(const Eigen::Vector3d& x) const {
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d from = x - corner[k];
    if (from.dot(corner[(k + 1) % 3] - corner[k]) <= 0 &&
        from.dot(corner[(k + 2) % 3] - corner[k]) <= 0)
      return Eigen::Vector3d::Unit(k);
  }
  Eigen::Vector3d share;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d& a = corner[(k + 1) % 3];
    const Eigen::Vector3d along = corner[(k + 2) % 3] - a;
    share[k] = along.cross(x - a).dot(normal) / area;
    if (share[k] > 0) continue;
    const double t = along.dot(x - a) / along.squaredNorm();
    if (t < 0 || t > 1) continue;
    share[k] = 0;
    share[(k + 1) % 3] = 1 - t;
    share[(k + 2) % 3] = t;
    break;
  }
  return share;
}

ShapeSample MeshDistance::at(const Eigen::Vector3d& x) const noexcept {
  // If several triangles are equally near, as at a common side, all of them decide between front
  // and back, by the angles at which they meet there. Sides that two of them share cancel; a border
  // remains.
  constexpr double kAsNear = 1 + 1e-9, kNone = 1e-6;
  if (boxes_.empty()) return {1e100, Eigen::Vector3d::Zero()};
  if (level_) {
    const Eigen::Vector3d& up = triangles_[0].normal;
    const double depth = up.dot(triangles_[0].centre - x);
    if (depth < thickness_ - depth) return {-depth, up};
    return {depth - thickness_, -up};
  }
  // The triangles of the nearest box give a first bound.
  const auto foot_on = [&](const Triangle& triangle, const Eigen::Vector3d& share) {
    const auto& corner = triangle.corner;
    return Eigen::Vector3d(share[0] * corner[0] + share[1] * corner[1] + share[2] * corner[2]);
  };
  const auto first =
      std::min_element(boxes_.begin(), boxes_.end(),
                       [&](const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
                         return a.squaredExteriorDistance(x) < b.squaredExteriorDistance(x);
                       });
  const std::size_t near_block = static_cast<std::size_t>(first - boxes_.begin());
  double most = std::numeric_limits<double>::max();
  for (std::size_t i = kBlock * near_block;
       i < std::min(triangles_.size(), kBlock * (near_block + 1)); ++i) {
    const Triangle& triangle = triangles_[i];
    most = std::min(most, (x - foot_on(triangle, triangle.nearest(x))).squaredNorm());
  }
  double nearest = kAsNear * most, reach = kAsNear * std::sqrt(nearest), size = 0;
  Eigen::Vector3d foot = x, front = x, border = x;
  for (std::size_t block = 0; block < boxes_.size(); ++block) {
    if (boxes_[block].squaredExteriorDistance(x) > kAsNear * nearest) continue;
    const std::size_t end = std::min(triangles_.size(), kBlock * (block + 1));
    for (std::size_t i = kBlock * block; i < end; ++i) {
      const Triangle& triangle = triangles_[i];
      const double far = kAsNear * (reach + triangle.reach);
      if ((x - triangle.centre).squaredNorm() > far * far) continue;
      const auto& corner = triangle.corner;
      const Eigen::Vector3d share = triangle.nearest(x);
      const Eigen::Vector3d point = foot_on(triangle, share);
      const double distance = (x - point).squaredNorm();
      const bool nearer = size == 0 ? distance <= nearest : kAsNear * distance < nearest;
      if (!nearer && (distance > kAsNear * nearest ||
                      (point - foot).squaredNorm() > 1e-8 * nearest + 1e-28 * foot.squaredNorm()))
        continue;
      if (nearer) {
        nearest = distance;
        reach = kAsNear * std::sqrt(nearest);
        foot = point;
        front = border = Eigen::Vector3d::Zero();
        size = triangle.area;
      }
      double angle = 2 * std::numbers::pi;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d &a = corner[(k + 1) % 3], &b = corner[(k + 2) % 3];
        if (share[k] == 1) {
          const Eigen::Vector3d to_a = a - corner[k], to_b = b - corner[k];
          angle = std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b));
        } else if (share[k] == 0 && share.maxCoeff() < 1) {
          angle = std::numbers::pi;
        } else {
          continue;
        }
        border += b - a;
      }
      front += angle * triangle.normal;
    }
  }
  if (size == 0) return {1e100, Eigen::Vector3d::Zero()};
  front.normalize();
  const Eigen::Vector3d out = x - foot;
  const double length = out.norm(), depth = -front.dot(out);
  const Eigen::Vector3d away = length > kNone * kNone * std::sqrt(size) ? out / length : front;
  if (depth <= 0) return {length, away};
  if (border.squaredNorm() > kNone * kNone * size) {
    const Eigen::Vector3d beside = out + std::min(depth, thickness_) * front;
    const double gap = beside.norm();
    if (gap > kNone * length) return {gap, beside / gap};
  }
  if (length < thickness_ - length) return {-length, -away};
  return {length - thickness_, away};
}

std::optional<Partner> Partner::of(const btCollisionShape& shape) {
  Partner partner(shape);
  switch (shape.getShapeType()) {
    case STATIC_PLANE_PROXYTYPE: {
      const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
      partner.field_.shape =
          HalfSpaceShape{to_eigen(plane.getPlaneNormal()), plane.getPlaneConstant()};
      return partner;
    }
    case BOX_SHAPE_PROXYTYPE:
      partner.field_.shape =
          BoxShape{to_eigen(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin())};
      return partner;
    case SPHERE_SHAPE_PROXYTYPE:
      partner.field_.shape = BallShape{static_cast<const btSphereShape&>(shape).getRadius()};
      return partner;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      partner.field_.shape = CapsuleShape{capsule.getRadius(), capsule.getHalfHeight()};
      partner.in_shape_ = from_z_to(capsule.getUpAxis());
      return partner;
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      const int up = cylinder.getUpAxis();
      partner.field_.shape =
          CylinderShape{cylinder.getRadius(), cylinder.getHalfExtentsWithMargin()[up]};
      partner.in_shape_ = from_z_to(up);
      return partner;
    }
    case CONE_SHAPE_PROXYTYPE:
      partner.field_.shape = FunctionShape{cone_sample, &shape, 0};
      partner.in_shape_ = from_z_to(static_cast<const btConeShape&>(shape).getConeUpIndex());
      return partner;
    case CONVEX_HULL_SHAPE_PROXYTYPE:
    case TETRAHEDRAL_SHAPE_PROXYTYPE:
    case CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE:
    case CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE: {
      std::vector<btVector3> points =
          corners_of(static_cast<const btPolyhedralConvexShape&>(shape));
      partner.hull_ = std::make_shared<const HullDistance>(points);
      if (partner.hull_->faces() < 4) return std::nullopt;
      partner.field_.shape = FunctionShape{hull_sample, partner.hull_.get(), 0};
      return partner;
    }
    case TERRAIN_SHAPE_PROXYTYPE: {
      btVector3 origin;
      if (!Terrain::find(static_cast<const btHeightfieldTerrainShape&>(shape), partner.field_,
                         origin)) {
        partner.mesh_ = &static_cast<const btConcaveShape&>(shape);
        return partner;
      }
      partner.in_shape_.setOrigin(origin);
      return partner;
    }
    case TRIANGLE_MESH_SHAPE_PROXYTYPE:
    case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE:
    case MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE:
      partner.mesh_ = &static_cast<const btConcaveShape&>(shape);
      return partner;
    default:
      return std::nullopt;
  }
}

PlacedShape Partner::placed(const btTransform& shape, const btVector3& lower,
                            const btVector3& upper, double thickness) const {
  PlacedShape placed = field_;
  placed.pose = to_pose(shape * in_shape_);
  if (mesh_ != nullptr) {
    thread_local MeshDistance near;
    near.gather(*mesh_, lower, upper, thickness);
    placed.shape = FunctionShape{mesh_sample, &near, 0};
  }
  return placed;
}

void Partner::add_faces(const PlacedShape& placed, bool of_b, SupportPolygon& polygon) const {
  const Eigen::Isometry3d pose = to_isometry(placed.pose);
  if (hull_ != nullptr) return hull_->add_faces(pose, of_b, polygon);
  if (mesh_ != nullptr) {
    const auto& near = std::get<FunctionShape>(placed.shape);
    return static_cast<const MeshDistance*>(near.context)->add_faces(pose, of_b, polygon);
  }
  const auto* const cylinder = std::get_if<CylinderShape>(&placed.shape);
  if (cylinder == nullptr) return;
  constexpr int kSides = 32;
  for (const double sign : {-1.0, 1.0}) {
    const auto rim = [&](int i) -> Eigen::Vector3d {
      const double turn = sign * 2 * std::numbers::pi * i / kSides;
      return pose * Eigen::Vector3d(cylinder->radius * std::cos(turn),
                                    cylinder->radius * std::sin(turn),
                                    sign * cylinder->half_height);
    };
    for (int i = 2; i < kSides; ++i) polygon.add_triangle(of_b, rim(0), rim(i - 1), rim(i));
  }
}

}  // namespace ist::bullet
