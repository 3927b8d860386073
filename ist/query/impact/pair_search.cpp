#include "query/impact/pair_search.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "query/impact/impact_side.h"

namespace ist {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TurningPoint turning_point(const MovingBody& body, const Matrix3d& turned, const Vector3d& base,
                           const Vector3d& x, double radius) noexcept {
  const Vector3d arm = turned * (x - body.centre);
  return {base + arm, body.spin_speed > 0 ? body.spin.cross(arm) : Vector3d::Zero().eval(),
          body.unit * radius};
}

double clear_step(const MovingFrame& frame, const Vector3d& n, double gap, double turning,
                  double speed_a, double speed_b) noexcept {
  // Speeds are rounded, so parts that slide may seem to approach by this fraction of them.
  constexpr double kSpeedRounding = 16 * 0x1p-53;
  const double slack = kSpeedRounding * (frame.speed + speed_a + speed_b);
  const double straight = slack - n.dot(frame.velocity);
  double bend = 0, most = straight;
  const auto add = [&](const MovingBody& body, double speed) {
    if (!(speed > 0)) return;
    const double across = n.cross(body.spin).norm();
    bend += across * speed;
    most += across * (speed / body.spin_speed);
  };
  add(frame.a, speed_a);
  add(frame.b, speed_b);
  const double now = safe_step(gap, straight + turning, bend);
  return bend > 0 ? std::max(now, safe_step(gap, most, 0)) : now;
}

namespace {

// Pairs of hulls further apart than this fraction of the smaller radius are advanced in time.
constexpr double kHullsApart = 0.01;

class PairSearch {
 public:
  PairSearch(const MovingFrame& frame, const ImpactSide& a, const ImpactSide& b,
             ImpactLoop& loop) noexcept
      : frame_(frame), a_(a), b_(b), loop_(loop) {}

  TimeOfImpact run() noexcept {
    loop_.visit_again(NodeKey{a_.top(), 0}.bits(), NodeKey{b_.top(), 0}.bits());
    return loop_.run([this](std::uint32_t a, std::uint32_t b, const Placement& at) {
      visit(NodeKey::of(a), NodeKey::of(b), at);
    });
  }

 private:
  struct Piece {
    ConvexPiece shape;     ///< in the frame
    Vector3d velocity[3];  ///< of its corners, by rotation
    double fastest = 0;    ///< of these
  };
  struct Approach {
    double gap, step;
  };

  TurningPoint ball_a(NodeKey node, const Placement& at) const noexcept {
    const NodeBall ball = a_.ball(node.level, node.number);
    return turning_point(frame_.a, at.a, Vector3d::Zero(), vector(ball.centre), ball.r);
  }
  TurningPoint ball_b(NodeKey node, const Placement& at) const noexcept {
    const NodeBall ball = b_.ball(node.level, node.number);
    return turning_point(frame_.b, at.b, at.between, vector(ball.centre), ball.r);
  }

  Approach approach(const TurningPoint& a, const TurningPoint& b,
                    const Placement& at) const noexcept {
    const Vector3d across = b.place - a.place;
    const double length = across.norm();
    const double gap = length - a.radius - b.radius - at.error - loop_.tolerance / 2;
    if (!(gap > 0)) return {gap, 0};
    const Vector3d n = across / length;
    return {gap, clear_step(frame_, n, gap, n.dot(a.velocity - b.velocity), a.velocity.norm(),
                            b.velocity.norm())};
  }

  void visit(NodeKey a, NodeKey b, const Placement& at) noexcept {
    const TurningPoint ball_of_a = ball_a(a, at), ball_of_b = ball_b(b, at);
    const Approach now = approach(ball_of_a, ball_of_b, at);
    if (now.gap > kFarApart * std::max(ball_of_a.radius, ball_of_b.radius) &&
        loop_.advances(now.step)) {
      loop_.clear_for(now.step, a.bits(), b.bits());
    } else if (a.level == kSphereLevel && b.level == kSphereLevel) {
      visit_pieces(a, b, at);
    } else if ((a_.has_hull(a.level) || b_.has_hull(b.level)) &&
               hulls_advance(a, b, ball_of_a, ball_of_b, at)) {
      return;
    } else if (b.level == kSphereLevel ||
               (a.level != kSphereLevel && ball_of_a.radius >= ball_of_b.radius)) {
      open(a, b, true, ball_of_b, at);
    } else {
      open(a, b, false, ball_of_a, at);
    }
  }

  /// True if a plane between the hulls advances the pair.
  bool hulls_advance(NodeKey key_a, NodeKey key_b, const TurningPoint& ball_of_a,
                     const TurningPoint& ball_of_b, const Placement& at) noexcept {
    const auto placed = [](PointHull hull, const MovingBody& body, const Matrix3d& turned,
                           const Vector3d& base) {
      const Vector3d shift = base - turned * body.centre;
      for (std::uint32_t k = 0; k < hull.count; ++k) {
        const Vector3d x = turned * Vector3d(hull.x[k], hull.y[k], hull.z[k]) + shift;
        hull.x[k] = x.x(), hull.y[k] = x.y(), hull.z[k] = x.z();
      }
      return hull;
    };
    const PointHull a =
        placed(a_.hull(key_a.level, key_a.number), frame_.a, at.a, Vector3d::Zero());
    const PointHull b = placed(b_.hull(key_b.level, key_b.number), frame_.b, at.b, at.between);
    const double margin = frame_.a.unit * a_.beyond(key_a.level, key_a.number) +
                          frame_.b.unit * b_.beyond(key_b.level, key_b.number) + at.error +
                          loop_.tolerance / 2;
    const HullPlane plane = plane_between(a, b, ball_of_b.place - ball_of_a.place, margin);
    const double gap = plane.apart - margin;
    if (!(gap > 0)) return false;
    // n · (ω × x) = (n × ω) · x
    const Vector3d& n = plane.normal;
    const Vector3d turn_a = n.cross(frame_.a.spin), turn_b = n.cross(frame_.b.spin);
    const double turning =
        turn_a.dot(furthest(a, turn_a)) - turn_b.dot(furthest(b, -turn_b)) + turn_b.dot(at.between);
    const double step = clear_step(
        frame_, n, gap, turning, ball_of_a.velocity.norm() + frame_.a.spin_speed * ball_of_a.radius,
        ball_of_b.velocity.norm() + frame_.b.spin_speed * ball_of_b.radius);
    if (gap <= kHullsApart * std::min(ball_of_a.radius, ball_of_b.radius) &&
        at.time + step < loop_.end)
      return false;
    if (!loop_.advances(step)) return false;
    loop_.clear_for(step, key_a.bits(), key_b.bits());
    return true;
  }

  void open(NodeKey a, NodeKey b, bool open_a, const TurningPoint& other,
            const Placement& at) noexcept {
    const NodeKey parent = open_a ? a : b;
    const std::uint32_t count = (open_a ? a_ : b_).children(parent.level, parent.number);
    for (std::uint32_t i = 0; i < count; ++i) {
      const NodeKey child{parent.level - 1, kWidth * parent.number + i};
      const Approach now =
          open_a ? approach(ball_a(child, at), other, at) : approach(other, ball_b(child, at), at);
      (open_a ? a : b) = child;
      if (loop_.advances(now.step)) {
        loop_.clear_for(now.step, a.bits(), b.bits());
      } else {
        loop_.visit_again(a.bits(), b.bits());
      }
    }
  }

  static Piece piece(const ImpactSide& side, const MovingBody& body, const Matrix3d& turned,
                     const Vector3d& base, std::uint32_t number) noexcept {
    Piece piece{side.piece(number), {}, 0};
    for (int k = 0; k < piece.shape.corners; ++k) {
      const TurningPoint corner = turning_point(body, turned, base, piece.shape.corner[k], 0);
      piece.shape.corner[k] = corner.place;
      piece.velocity[k] = corner.velocity;
      piece.fastest = std::max(piece.fastest, corner.velocity.norm());
    }
    piece.shape.beyond *= body.unit;
    piece.shape.behind *= body.unit;
    return piece;
  }

  void visit_pieces(NodeKey key_a, NodeKey key_b, const Placement& at) noexcept {
    loop_.count_surface_pair();
    const Piece a = piece(a_, frame_.a, at.a, Vector3d::Zero(), key_a.number);
    const Piece b = piece(b_, frame_.b, at.b, at.between, key_b.number);
    const NearestPoints nearest = nearest_points(a.shape, b.shape);
    const double margin = a.shape.beyond + b.shape.beyond + at.error;

    // Any separating plane bounds the time for which the pieces stay clear: the one between the
    // nearest points, and those of both faces for pieces that slide along them.
    struct Plane {
      Vector3d normal = Vector3d::Zero();
      double gap = -std::numeric_limits<double>::infinity(), rate = 0, step = 0;
    } best, widest;  // the longest step, the largest gap
    const auto try_plane = [&](const Vector3d& n) {
      Plane plane{n, apart_along(n, a.shape, b.shape) - margin, 0, 0};
      if (plane.gap > widest.gap) widest = plane;
      if (!(plane.gap > 0)) return;
      double fastest = -std::numeric_limits<double>::infinity();
      double slowest = std::numeric_limits<double>::infinity();
      for (int k = 0; k < a.shape.corners; ++k) fastest = std::max(fastest, n.dot(a.velocity[k]));
      for (int k = 0; k < b.shape.corners; ++k) slowest = std::min(slowest, n.dot(b.velocity[k]));
      plane.rate = fastest - slowest - n.dot(frame_.velocity);
      const double left = gap_left(plane.gap, loop_.tolerance);
      plane.step = clear_step(frame_, n, plane.gap - left, fastest - slowest, a.fastest, b.fastest);
      if (!(best.step >= plane.step)) best = plane;
    };
    if (nearest.distance > 0) {
      try_plane((nearest.b - nearest.a) / nearest.distance);
      for (const ConvexPiece* const face : {&a.shape, &b.shape}) {
        if (face->corners < 3) continue;
        const Vector3d n =
            (face->corner[1] - face->corner[0]).cross(face->corner[2] - face->corner[0]);
        const double length = n.norm();
        if (!(length > 0)) continue;
        try_plane(n.dot(nearest.b - nearest.a) > 0 ? Vector3d(n / length) : Vector3d(-n / length));
      }
    }

    const bool near = widest.gap <= kReported * loop_.tolerance;
    if (loop_.advances(best.step) &&
        (!near || !(best.rate > 0) || !(at.time + best.step < loop_.end)))
      return loop_.clear_for(best.step, key_a.bits(), key_b.bits(),
                             gap_left(best.gap, loop_.tolerance));
    ImpactFound found;
    found.gap = widest.gap;
    found.distance = nearest.distance + a.shape.behind + b.shape.behind + at.error;
    found.normal = widest.normal;
    // A sphere's piece is its centre: the contact point is on the surface.
    found.point_a = nearest.a - std::min(0.0, a.shape.behind) * found.normal;
    found.point_b = nearest.b + std::min(0.0, b.shape.behind) * found.normal;
    found.kind = found.distance <= loop_.tolerance ? ImpactKind::impact : ImpactKind::unresolved;
    if (at.time == 0 && !(best.gap > 0)) {
      const bool faces = a.shape.corners == 3 && b.shape.corners == 3;
      const double inner =
          nearest.distance + std::min(0.0, a.shape.behind) + std::min(0.0, b.shape.behind);
      const bool overlaps =
          faces ? nearest.distance <= at.error || triangles_cross(a.shape, b.shape) : inner <= 0;
      found.kind = overlaps ? ImpactKind::overlapping : ImpactKind::unresolved;
    }
    loop_.found(found);
  }

  const MovingFrame& frame_;
  const ImpactSide& a_;
  const ImpactSide& b_;
  ImpactLoop& loop_;
};

}  // namespace

TimeOfImpact search_pair(const MovingFrame& frame, const ImpactSide& a, const ImpactSide& b,
                         ImpactLoop& loop) noexcept {
  return PairSearch(frame, a, b, loop).run();
}

}  // namespace ist
