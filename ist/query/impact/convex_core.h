#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "query/impact/convex_pair.h"
#include "query/impact/gjk.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/shapes.h"

// Convex fields as all points within a radius of a core whose furthest point in a direction is
// known, and their distance from triangles.

namespace ist {

/// Shapes whose tangent plane at the nearest point has all of them on one side.
template <class Sampler>
inline constexpr bool kConvex = false;
template <>
inline constexpr bool kConvex<HalfSpaceSampler> = true;
template <>
inline constexpr bool kConvex<BoxSampler> = true;
template <>
inline constexpr bool kConvex<BallSampler> = true;
template <>
inline constexpr bool kConvex<CapsuleSampler> = true;
template <>
inline constexpr bool kConvex<CylinderSampler> = true;

inline double core_radius(const BoxSampler&) noexcept { return 0; }
inline double core_radius(const BallSampler& s) noexcept { return s.radius; }
inline double core_radius(const CapsuleSampler& s) noexcept { return s.radius; }
inline double core_radius(const CylinderSampler&) noexcept { return 0; }

inline Eigen::Vector3d furthest(const BoxSampler& s, const Eigen::Vector3d& n) noexcept {
  return {std::copysign(s.half[0], n.x()), std::copysign(s.half[1], n.y()),
          std::copysign(s.half[2], n.z())};
}
inline Eigen::Vector3d furthest(const BallSampler&, const Eigen::Vector3d&) noexcept {
  return Eigen::Vector3d::Zero();
}
inline Eigen::Vector3d furthest(const CapsuleSampler& s, const Eigen::Vector3d& n) noexcept {
  return {0, 0, std::copysign(s.half, n.z())};
}
inline Eigen::Vector3d furthest(const CylinderSampler& s, const Eigen::Vector3d& n) noexcept {
  const double across = std::sqrt(n.x() * n.x() + n.y() * n.y());
  const double to = across > 0 ? s.radius / across : 0;
  return {to * n.x(), to * n.y(), std::copysign(s.half, n.z())};
}

/// A plane between a convex field and a triangle, all in one frame.
struct PlaneBetween {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, from the shape to the triangle
  double apart = 0;     ///< > 0: they lie so far apart along it, a proof; else they may meet
  double distance = 0;  ///< they are no further apart than this
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< of the triangle, so near
};

template <class Sampler>
PlaneBetween plane_between(const Sampler& shape, const ConvexPiece& triangle) noexcept {
  // A plane that is tilted by as much as costs so little of the gap is good enough.
  constexpr double kEnough = 0.995;
  constexpr int kSteps = 60;
  const double radius = core_radius(shape);
  PlaneBetween best;
  best.apart = -std::numeric_limits<double>::infinity();
  GjkDistance between;
  best.point = (triangle.corner[0] + triangle.corner[1] + triangle.corner[2]) / 3;
  Eigen::Vector3d across = best.point;  // the core contains the origin
  for (int i = 0; i < kSteps; ++i) {
    const double length = across.norm();
    best.distance = std::max(0.0, length - radius);
    if (!(best.distance > 0)) return best;
    const Eigen::Vector3d n = across / length;
    int nearest = 0;
    for (int k = 1; k < 3; ++k)
      if (n.dot(triangle.corner[k]) < n.dot(triangle.corner[nearest])) nearest = k;
    const Eigen::Vector3d difference = triangle.corner[nearest] - furthest(shape, n);
    const double apart = n.dot(difference) - radius;
    if (apart > best.apart) {
      best.apart = apart;
      best.normal = n;
    }
    if (best.apart >= kEnough * best.distance) break;
    const bool nearer = between.add(difference, triangle.corner[nearest]);
    if (!nearer && i > 0) break;
    across = between.shortest();
    best.point = between.point();
  }
  return best;
}

/// A half-space has one plane.
inline PlaneBetween plane_between(const HalfSpaceSampler& shape,
                                  const ConvexPiece& triangle) noexcept {
  PlaneBetween between;
  between.normal = Eigen::Vector3d(shape.normal);
  between.apart = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& corner : triangle.corner) {
    const double height = between.normal.dot(corner) - shape.offset;
    if (height >= between.apart) continue;
    between.apart = between.distance = height;
    between.point = corner;
  }
  between.distance = std::max(0.0, between.distance);
  return between;
}

}  // namespace ist
