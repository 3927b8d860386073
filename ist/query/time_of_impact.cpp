#include <ist/time_of_impact.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "query/base/no_answer.h"
#include "query/exact/mesh_queries.h"
#include "query/impact/impact_side.h"
#include "query/impact/moving_frame.h"
#include "query/impact/pair_search.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/shapes.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

/// Convex shapes, except the half-space, are all points within a radius of a core.
template <class Sampler>
double core_radius(const Sampler& s) noexcept {
  constexpr bool kRound =
      std::is_same_v<Sampler, BallSampler> || std::is_same_v<Sampler, CapsuleSampler>;
  if constexpr (kRound)
    return s.radius;
  else
    return 0;
}

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

template <class Sampler>
inline constexpr bool kConvex = std::is_same_v<Sampler, HalfSpaceSampler> ||
                                requires(const Sampler& s, const Eigen::Vector3d& n) {
  furthest(s, n);
};

/// A plane between a convex shape and a triangle, all in one frame.
struct PlaneBetween {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, from the shape to the triangle
  double apart = 0;     ///< > 0: a lower bound on their distance; else they may intersect
  double distance = 0;  ///< an upper bound
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< of the triangle, at `distance`
};

template <class Sampler>
PlaneBetween plane_between(const Sampler& shape, const ConvexPiece& triangle) noexcept {
  // A plane that shows this much of the distance is good enough.
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
    // No point is nearer than a plane has shown, but for rounding.
    if (best.apart > 0 && between.shortest().norm() - radius < (1 - 1e-9) * best.apart) break;
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

/// A part of a triangle in 32 bits: the number of subdivisions in four, and the quarter of each.
struct TrianglePart {
  static constexpr std::uint32_t kMostCuts = 14;
  static std::uint32_t cuts(std::uint32_t bits) noexcept { return bits >> 28; }
  static std::uint32_t quarter(std::uint32_t bits, std::uint32_t which) noexcept {
    return bits + (1u << 28) + (which << (2 * cuts(bits)));
  }
  /// Replaces the triangle's corners by the part's.
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

/// Searches for the impact of a moving shape and a moving tree.
template <class Sampler>
class ShapeSearch {
 public:
  ShapeSearch(Sampler& shape, const MovingFrame& frame, const ImpactSide& b,
              ImpactLoop& loop) noexcept
      : shape_(shape), frame_(frame), b_(b), loop_(loop) {}

  TimeOfImpact run() noexcept {
    loop_.visit_again(0, NodeKey{b_.top(), 0}.bits());
    return loop_.run([this](std::uint32_t part, std::uint32_t b, const Placement& at) {
      const NodeKey node = NodeKey::of(b);
      if (node.level != kSphereLevel) {
        visit_node(node, at);
      } else if (b_.mesh() == nullptr) {
        visit_sphere(node, at);
      } else if constexpr (kConvex<Sampler>) {
        visit_triangle(node, at);
      } else {
        visit_part(part, node, at);
      }
    });
  }

 private:
  using Vector3d = Eigen::Vector3d;

  /// The shape's distance from a point of the frame.
  struct Sample {
    double distance;  ///< negative inside; too small by at most the shape's error
    Vector3d normal;  ///< from the shape to the point; zero if unknown
  };
  Sample sample(const Vector3d& x, const Placement& at) const noexcept {
    const ShapeSample own = shape_.nearest(at.a.transpose() * x + frame_.a.centre);
    const double length = own.gradient.norm();
    const Vector3d out = length > 0 ? Vector3d(own.gradient / length) : Vector3d::Zero().eval();
    return {own.distance, at.a * out};
  }
  double margin(const Placement& at) const noexcept { return shape_.error() + at.error; }

  TurningPoint point_of_b(const Vector3d& x, double radius, const Placement& at) const noexcept {
    return turning_point(frame_.b, at.b, at.between, x, radius);
  }

  /// The time for which a part of B keeps a gap in any direction.
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

  /// The same for a ball around a point of B.
  double ball_step(double gap, const Sample& seen, const TurningPoint& point) const noexcept {
    if (kConvex<Sampler> && frame_.a.spin_speed == 0 && !seen.normal.isZero(0))
      return clear_step(frame_, seen.normal, gap, -seen.normal.dot(point.velocity), 0,
                        point.velocity.norm());
    return any_step(gap, point, point.place.norm());
  }

  /// The speed at which a point of B approaches now.
  double rate(const Vector3d& normal, const TurningPoint& point) const noexcept {
    return -normal.dot(frame_.velocity + point.velocity - frame_.a.spin.cross(point.place));
  }

  void overlap_at(const Vector3d& x) noexcept {
    ImpactFound found;
    found.kind = ImpactKind::overlapping;
    found.point_a = found.point_b = x;
    loop_.found(found);
  }

  void visit_node(NodeKey node, const Placement& at) noexcept {
    const NodeBall ball = b_.ball(node.level, node.number);
    const TurningPoint point = point_of_b(vector(ball.centre), ball.r, at);
    const Sample seen = sample(point.place, at);
    if (at.time == 0 && seen.distance < -(point.radius + margin(at)))
      return overlap_at(point.place);
    const double gap = seen.distance - point.radius - margin(at) - loop_.tolerance / 2;
    if (gap > kFarApart * point.radius) {
      const double step = ball_step(gap, seen, point);
      if (loop_.advances(step)) return loop_.clear_for(step, 0, node.bits());
    }
    const std::uint32_t count = b_.children(node.level, node.number);
    for (std::uint32_t i = 0; i < count; ++i)
      loop_.visit_again(0, NodeKey{node.level - 1, kWidth * node.number + i}.bits());
  }

  /// Bounds on the distance of a part of B, and its next step.
  struct Part {
    double gap;       ///< lower bound
    double distance;  ///< upper bound
    double step;      ///< leaves half of the tolerance, or of a smaller gap
    double rate;      ///< speed of approach
    Vector3d point;   ///< on B, in the frame
    Vector3d normal;
  };
  void decide(const Part& part, std::uint32_t cuts, NodeKey node, const Placement& at) noexcept {
    const bool near = part.gap <= kReported * loop_.tolerance;
    if (part.gap > 0 && loop_.advances(part.step) &&
        (!near || !(part.rate > 0) || !(at.time + part.step < loop_.end)))
      return loop_.clear_for(part.step, cuts, node.bits(), gap_left(part.gap, loop_.tolerance));
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

  void visit_sphere(NodeKey node, const Placement& at) noexcept {
    loop_.count_surface_pair();
    const ConvexPiece piece = b_.piece(node.number);
    const TurningPoint point = point_of_b(piece.corner[0], piece.beyond, at);
    const Sample seen = sample(point.place, at);
    const double r = -frame_.b.unit * piece.behind;
    if (at.time == 0 && seen.distance <= r) return overlap_at(point.place);
    const double gap = seen.distance - point.radius - margin(at);
    decide({gap, seen.distance - r + margin(at),
            ball_step(gap - gap_left(gap, loop_.tolerance), seen, point), rate(seen.normal, point),
            point.place - r * seen.normal, seen.normal},
           0, node, at);
  }

  /// Bounds a triangle's distance from a convex shape by a plane between the two.
  void visit_triangle(NodeKey node, const Placement& at) noexcept {
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
    if (at.time == 0 && plane.distance <= at.error) return overlap_at(point);
    const Vector3d normal = at.a * plane.normal;
    const double error = frame_.b.unit * piece.beyond;
    const double gap = plane.apart - error - margin(at);
    double turning = -std::numeric_limits<double>::infinity(), nearing = turning;
    for (const TurningPoint& c : corner) {
      turning = std::max(turning, -normal.dot(c.velocity));
      nearing = std::max(nearing, rate(normal, c));
    }
    const double more = gap - gap_left(gap, loop_.tolerance);
    const double step = frame_.a.spin_speed == 0
                            ? clear_step(frame_, normal, more, turning, 0, fastest.velocity.norm())
                            : any_step(more, fastest, arm);
    decide({gap, plane.distance + error + margin(at), step, nearing, point, normal}, 0, node, at);
  }

  /// Subdivides a part of a triangle that is not small compared with its gap.
  void visit_part(std::uint32_t part, NodeKey node, const Placement& at) noexcept {
    loop_.count_surface_pair();
    ConvexPiece piece = b_.piece(node.number);
    TrianglePart::cut(part, piece.corner);
    const Vector3d middle = (piece.corner[0] + piece.corner[1] + piece.corner[2]) / 3;
    double r2 = 0;
    for (const Vector3d& c : piece.corner) r2 = std::max(r2, (c - middle).squaredNorm());
    const double error = frame_.b.unit * piece.beyond;
    const double size = (1 + 1e-12) * frame_.b.unit * std::sqrt(r2);
    const TurningPoint point = point_of_b(middle, piece.beyond, at);
    const Sample seen = sample(point.place, at);
    if (at.time == 0 && seen.distance < -margin(at)) return overlap_at(point.place);
    const double gap = seen.distance - size - error - margin(at);
    const bool small =
        size <= kSmallPart * loop_.tolerance || TrianglePart::cuts(part) == TrianglePart::kMostCuts;
    if (!small && gap <= kReported * loop_.tolerance + kFarApart * size) {
      for (std::uint32_t i = 0; i < 4; ++i)
        loop_.visit_again(TrianglePart::quarter(part, i), node.bits());
      return;
    }
    decide({gap, seen.distance + error + margin(at),
            ball_step(gap - gap_left(gap, loop_.tolerance), seen, point), rate(seen.normal, point),
            point.place, seen.normal},
           part, node, at);
  }

  static constexpr double kSmallPart = 1.0 / 16;

  Sampler& shape_;
  const MovingFrame& frame_;
  const ImpactSide& b_;
  ImpactLoop& loop_;
};

TimeOfImpact overlap() noexcept {
  TimeOfImpact result;
  result.kind = ImpactKind::overlapping;
  return result;
}

/// In the frame's unit of length. `smaller`: the smaller solid's bounding radius; `errors`: of the
/// meshes, by which an impact's gap is uncertain.
double tolerance_of(const ImpactSettings& settings, double smaller, double errors,
                    double unit) noexcept {
  return settings.tolerance > 0 ? settings.tolerance / unit : std::max(1e-3 * smaller, 10 * errors);
}

double bounding_radius(const PlacedAsset& placed) noexcept {
  return root_ball(placed.asset.header()).r;
}

/// True if one solid contains a part of the other without an intersection of their surfaces.
bool one_contains_other(const ImpactSide& a, const ImpactSide& b,
                        const RelativePose& pose) noexcept {
  return (a.mesh() != nullptr && contains_part(*a.mesh(), b, pose.a_from_b)) ||
         (b.mesh() != nullptr && contains_part(*b.mesh(), a, pose.b_from_a));
}

}  // namespace

TimeOfImpact find_impact(const PlacedAsset& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept {
  const std::optional<MovingFrame> frame = moving_frame(a, b, motions, settings.duration);
  if (!frame || workspace.impl() == nullptr) return invalid_input<TimeOfImpact>();
  const ImpactSide side_a(a.asset), side_b(b.asset);
  if (one_contains_other(side_a, side_b, frame->start)) return overlap();
  const double smaller =
      std::min(bounding_radius(a) * frame->a.unit, bounding_radius(b) * frame->b.unit);
  const double errors = side_a.mesh_error() * frame->a.unit + side_b.mesh_error() * frame->b.unit;
  ImpactLoop loop(*frame, tolerance_of(settings, smaller, errors, frame->unit), settings,
                  *workspace.impl());
  return search_pair(*frame, side_a, side_b, loop);
}

TimeOfImpact find_impact(const PlacedShape& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept {
  const std::optional<MovingFrame> frame = moving_frame(a, b, motions, settings.duration);
  if (!frame || workspace.impl() == nullptr) return invalid_input<TimeOfImpact>();
  const ImpactSide side(b.asset);
  const double tolerance = tolerance_of(settings, bounding_radius(b) * frame->b.unit,
                                        side.mesh_error() * frame->b.unit, frame->unit);
  return with_shape(
      a.shape,
      [&]<class Sampler>(Sampler& shape) {
        if constexpr (kConvex<Sampler> && !std::is_same_v<Sampler, HalfSpaceSampler>) {
          // The whole shape is inside B if its centre is and the surfaces do not intersect.
          const Vec3 middle = vec3(frame->start.b_from_a.t);
          if (side.mesh() != nullptr && is_inside({*side.mesh()}, {middle.x, middle.y, middle.z}))
            return overlap();
        }
        ImpactLoop loop(*frame, tolerance, settings, *workspace.impl());
        return ShapeSearch<Sampler>(shape, *frame, side, loop).run();
      },
      invalid_input<TimeOfImpact>);
}

}  // namespace ist
