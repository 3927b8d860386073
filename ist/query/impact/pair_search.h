#pragma once

#include "query/impact/impact_side.h"
#include "query/impact/moving_frame.h"

namespace ist {

/// A node of a tree in 32 bits, level and number: spheres and triangles come first.
struct NodeKey {
  int level;
  std::uint32_t number;

  static NodeKey of(std::uint32_t bits) noexcept {
    return {static_cast<int>(bits >> kNumberBits) + kSphereLevel, bits & ((1u << kNumberBits) - 1)};
  }
  std::uint32_t bits() const noexcept {
    return static_cast<std::uint32_t>(level - kSphereLevel) << kNumberBits | number;
  }

  static constexpr int kNumberBits = 28;  // 16^7 spheres
};
static_assert(kMaxSpheres == std::uint64_t{1} << NodeKey::kNumberBits);

/// A point of a rotating body, or a ball around it.
struct TurningPoint {
  Eigen::Vector3d place;     ///< in the frame
  Eigen::Vector3d velocity;  ///< by rotation alone
  double radius = 0;
};

/// `turned`: the body's unit · R; `base`: its straight point.
TurningPoint turning_point(const MovingBody& body, const Eigen::Matrix3d& turned,
                           const Eigen::Vector3d& base, const Eigen::Vector3d& x,
                           double radius) noexcept;

/// The time for which two convex parts with a gap along the unit vector n, A to B, stay clear.
///
/// `turning`: their approach along n now, by rotation alone; speed_a, speed_b: bounds on the speeds
/// of their points by rotation. Only the centres of balls count, since balls do not change by
/// rotation.
double clear_step(const MovingFrame& frame, const Eigen::Vector3d& n, double gap, double turning,
                  double speed_a, double speed_b) noexcept;

/// Searches for the impact of two moving trees.
TimeOfImpact search_pair(const MovingFrame& frame, const ImpactSide& a, const ImpactSide& b,
                         ImpactLoop& loop) noexcept;

}  // namespace ist
