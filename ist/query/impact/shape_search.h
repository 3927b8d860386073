#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "query/impact/convex_core.h"
#include "query/impact/impact_loop.h"
#include "query/impact/impact_side.h"
#include "query/impact/node_key.h"
#include "query/impact/pair_search.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/shapes.h"

namespace ist {

/// A part of a triangle in 32 bits: how often it is cut in four, and which of four each time.
struct TrianglePart {
  static constexpr std::uint32_t kMostCuts = 14;
  static std::uint32_t cuts(std::uint32_t bits) noexcept { return bits >> 28; }
  static std::uint32_t quarter(std::uint32_t bits, std::uint32_t which) noexcept {
    return bits + (1u << 28) + (which << (2 * cuts(bits)));
  }
  /// The part's corners in the triangle's place.
  static void cut(std::uint32_t bits, Eigen::Vector3d (&corner)[3]) noexcept {
    for (std::uint32_t i = 0; i < cuts(bits); ++i) {
      const std::uint32_t which = bits >> (2 * i) & 3;
      const Eigen::Vector3d middle[3] = {(corner[1] + corner[2]) / 2, (corner[2] + corner[0]) / 2,
                                         (corner[0] + corner[1]) / 2};
      if (which == 3) {
        for (int k = 0; k < 3; ++k) corner[k] = middle[k];
      } else {
        for (std::uint32_t k = 0; k < 3; ++k)
          if (k != which) corner[k] = middle[3 - k - which];
      }
    }
  }
};

/// The search for the impact of a shape and a tree, both moving.
template <class Sampler>
class ShapeSearch {
 public:
  ShapeSearch(Sampler& shape, const MovingFrame& frame, const ImpactSide& b,
              ImpactLoop& loop) noexcept
      : shape_(shape), frame_(frame), b_(b), loop_(loop) {}

  TimeOfImpact run() noexcept {
    loop_.look_again(0, NodeKey{b_.top(), 0}.bits());
    return loop_.run([this](std::uint32_t part, std::uint32_t b, const Placement& at) {
      const NodeKey node = NodeKey::of(b);
      if (node.level != kSphereLevel) {
        look_at_node(node, at);
      } else if (b_.mesh() == nullptr) {
        look_at_sphere(node, at);
      } else if constexpr (kConvex<Sampler>) {
        look_at_triangle(node, at);
      } else {
        look_at_part(part, node, at);
      }
    });
  }

 private:
  using Vector3d = Eigen::Vector3d;

  /// The shape seen from a place of the frame.
  struct Sight {
    double distance;  ///< from the shape, negative inside; no less by more than the shape's error
    Vector3d normal;  ///< from the shape to the place; zero where it tells none
  };
  Sight sight(const Vector3d& x, const Placement& at) const noexcept {
    const ShapeSample sample = shape_.nearest(at.a.transpose() * x + frame_.a.centre);
    const double length = sample.gradient.norm();
    const Vector3d out = length > 0 ? Vector3d(sample.gradient / length) : Vector3d::Zero().eval();
    return {sample.distance, at.a * out};
  }
  double lost(const Placement& at) const noexcept { return shape_.error() + at.error; }

  TurningPoint point_of_b(const Vector3d& x, double radius, const Placement& at) const noexcept {
    return turning_point(frame_.b, at.b, at.between, x, radius);
  }

  /// For how long a part of B keeps a gap: in any direction.
  double any_step(double gap, const TurningPoint& point, double arm) const noexcept {
    const double speed = point.velocity.norm(), spin_a = frame_.a.spin_speed;
    const double most = (1 + 1e-12) * (frame_.speed + speed);
    double step = safe_step(gap, most + spin_a * arm, spin_a * most);
    if (spin_a == 0) {
      const double now = (frame_.velocity + point.velocity).norm() + 1e-12 * most;
      step = std::max(step, safe_step(gap, now, frame_.b.spin_speed * speed));
    }
    return step;
  }

  /// Likewise of a ball around a point of B.
  double ball_step(double gap, const Sight& seen, const TurningPoint& point) const noexcept {
    if (kConvex<Sampler> && frame_.a.spin_speed == 0 && !seen.normal.isZero(0))
      return clear_step(frame_, seen.normal, gap, -seen.normal.dot(point.velocity), 0,
                        point.velocity.norm());
    return any_step(gap, point, point.place.norm());
  }

  /// How fast a point of B approaches now.
  double rate(const Vector3d& normal, const TurningPoint& point) const noexcept {
    return -normal.dot(frame_.velocity + point.velocity - frame_.a.spin.cross(point.place));
  }

  void meet(const Vector3d& x) noexcept {
    ImpactFound found;
    found.kind = ImpactKind::overlapping;
    found.point_a = found.point_b = x;
    loop_.found(found);
  }

  void look_at_node(NodeKey node, const Placement& at) noexcept {
    const NodeBall ball = b_.ball(node.level, node.number);
    const TurningPoint point =
        point_of_b({ball.centre[0], ball.centre[1], ball.centre[2]}, ball.r, at);
    const Sight seen = sight(point.place, at);
    if (at.time == 0 && seen.distance < -(point.radius + lost(at))) return meet(point.place);
    const double gap = seen.distance - point.radius - lost(at) - loop_.tolerance / 2;
    if (gap > kFarApart * point.radius) {
      const double step = ball_step(gap, seen, point);
      if (loop_.leads_on(step)) return loop_.clear_for(step, 0, node.bits());
    }
    const std::uint32_t count = b_.children(node.level, node.number);
    for (std::uint32_t i = 0; i < count; ++i)
      loop_.look_again(0, NodeKey{node.level - 1, kWidth * node.number + i}.bits());
  }

  /// Proven bounds of a part of B, and the next step for it.
  struct Part {
    double gap;       ///< proven
    double distance;  ///< at most
    double step;      ///< it keeps half of what it has of the tolerance
    double rate;      ///< at which it approaches
    Vector3d point;   ///< on B, in the frame
    Vector3d normal;
  };
  void decide(const Part& part, std::uint32_t cuts, NodeKey node, const Placement& at) noexcept {
    const bool near = part.gap <= kReported * loop_.tolerance;
    if (part.gap > 0 && loop_.leads_on(part.step) &&
        (!near || !(part.rate > 0) || !(at.time + part.step < loop_.end))) {
      return loop_.clear_for(part.step, cuts, node.bits(), std::min(loop_.tolerance, part.gap) / 2);
    }
    ImpactFound found;
    found.gap = part.gap;
    found.distance = part.distance;
    found.kind = part.distance <= loop_.tolerance && part.gap > 0 ? ImpactKind::impact
                                                                  : ImpactKind::unresolved;
    found.normal = part.normal;
    found.point_b = part.point;
    found.point_a = part.point - std::max(0.0, part.distance) * part.normal;
    loop_.found(found);
  }
  double half_left(double gap) const noexcept { return std::min(loop_.tolerance, gap) / 2; }

  void look_at_sphere(NodeKey node, const Placement& at) noexcept {
    loop_.count_surface_pair();
    const ConvexPiece piece = b_.piece(node.number);
    const TurningPoint point = point_of_b(piece.corner[0], piece.beyond, at);
    const Sight seen = sight(point.place, at);
    const double r = -frame_.b.unit * piece.behind;
    if (at.time == 0 && seen.distance <= r) return meet(point.place);
    const double gap = seen.distance - point.radius - lost(at);
    decide({gap, seen.distance - r + lost(at), ball_step(gap - half_left(gap), seen, point),
            rate(seen.normal, point), point.place - r * seen.normal, seen.normal},
           0, node, at);
  }

  /// A triangle before a convex shape: as far as the plane between tells.
  void look_at_triangle(NodeKey node, const Placement& at) noexcept {
    loop_.count_surface_pair();
    const ConvexPiece piece = b_.piece(node.number);
    TurningPoint corner[3];
    ConvexPiece triangle = piece;  // in the shape's frame
    TurningPoint fastest{Vector3d::Zero(), Vector3d::Zero(), 0};
    double arm = 0;
    for (int k = 0; k < 3; ++k) {
      corner[k] = point_of_b(piece.corner[k], 0, at);
      triangle.corner[k] = at.a.transpose() * corner[k].place + frame_.a.centre;
      if (corner[k].velocity.norm() > fastest.velocity.norm()) fastest = corner[k];
      arm = std::max(arm, corner[k].place.norm());
    }
    const PlaneBetween plane = plane_between(shape_, triangle);
    const Vector3d point = at.a * (plane.point - frame_.a.centre);
    if (at.time == 0 && plane.distance <= at.error) return meet(point);
    const Vector3d normal = at.a * plane.normal;
    const double error = frame_.b.unit * piece.beyond;
    const double gap = plane.apart - error - lost(at);
    double turning = -std::numeric_limits<double>::infinity(), nearing = turning;
    for (const TurningPoint& c : corner) {
      turning = std::max(turning, -normal.dot(c.velocity));
      nearing = std::max(nearing, rate(normal, c));
    }
    const double more = gap - half_left(gap);
    const double step = frame_.a.spin_speed == 0
                            ? clear_step(frame_, normal, more, turning, 0, fastest.velocity.norm())
                            : any_step(more, fastest, arm);
    decide({gap, plane.distance + error + lost(at), step, nearing, point, normal}, 0, node, at);
  }

  /// A part of a triangle that is small beside its gap.
  void look_at_part(std::uint32_t part, NodeKey node, const Placement& at) noexcept {
    loop_.count_surface_pair();
    ConvexPiece piece = b_.piece(node.number);
    TrianglePart::cut(part, piece.corner);
    const Vector3d middle = (piece.corner[0] + piece.corner[1] + piece.corner[2]) / 3;
    double r2 = 0;
    for (const Vector3d& c : piece.corner) r2 = std::max(r2, (c - middle).squaredNorm());
    const double error = frame_.b.unit * piece.beyond;
    const double size = (1 + 1e-12) * frame_.b.unit * std::sqrt(r2);
    const TurningPoint point = point_of_b(middle, piece.beyond, at);
    const Sight seen = sight(point.place, at);
    if (at.time == 0 && seen.distance < -lost(at)) return meet(point.place);
    const double gap = seen.distance - size - error - lost(at);
    const bool small =
        size <= kSmallPart * loop_.tolerance || TrianglePart::cuts(part) == TrianglePart::kMostCuts;
    if (!small && gap <= kReported * loop_.tolerance + kFarApart * size) {
      for (std::uint32_t i = 0; i < 4; ++i)
        loop_.look_again(TrianglePart::quarter(part, i), node.bits());
      return;
    }
    decide({gap, seen.distance + error + lost(at), ball_step(gap - half_left(gap), seen, point),
            rate(seen.normal, point), point.place, seen.normal},
           part, node, at);
  }

  static constexpr double kSmallPart = 1.0 / 16;

  Sampler& shape_;
  const MovingFrame& frame_;
  const ImpactSide& b_;
  ImpactLoop& loop_;
};

}  // namespace ist
