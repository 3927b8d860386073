#include "robots/covers/cover_proof.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/mesh_view.h"
#include "robots/covers/offset_surface.h"
#include "robots/covers/triangles.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kRounded = 1e-5;  ///< unit frame, by which the proof may exceed the maximum found
constexpr double kTolerance = 0.01;

/// Divides the cube around a ball until no part can contain a point further out than found.
class ProtrusionSearch {
 public:
  ProtrusionSearch(const MeshSolid& solid, const CoverSphere& ball, double tolerance, double enough,
                   std::vector<Vector3d>* beyond)
      : solid_(solid), ball_(ball), tolerance_(tolerance), enough_(enough), beyond_(beyond) {}

  BallProtrusion found() {
    const ClosestPoint near = closest(ball_.centre);
    const bool inside = solid_.inside(ball_.centre);
    // No point of the ball is further out than its centre's distance plus its radius.
    whole_ =
        std::max(0.0, ball_.radius + (inside ? -near.distance : near.distance)) + kDistanceMargin;
    // If the solid is convex, this is the furthest point.
    if (near.distance > 0)
      see(ball_.centre +
          (near.point - ball_.centre) * ((inside ? 1 : -1) * 2 * ball_.radius / near.distance));
    look(ball_.centre, ball_.radius, false);
    return result_;
  }

 private:
  /// If points beyond are requested, nothing is proven, and float is accurate enough.
  ClosestPoint closest(const Vector3d& x) const {
    if (beyond_ == nullptr) return solid_.closest_point(x);
    const Eigen::Vector3f p = x.cast<float>();
    const NearestTriangle near = nearest_triangle(solid_.view(), p.data());
    return {{near.point[0], near.point[1], near.point[2]},
            std::sqrt(double{near.distance2}),
            near.triangle};
  }

  double threshold() const {
    return std::max({enough_, result_.least * (1 + tolerance_), kFinest * ball_.radius});
  }

  void settle(double bound) { result_.most = std::max(result_.most, bound); }

  /// `outside`: the whole cube is known to be outside.
  void look(const Vector3d& middle, double half, bool outside) {
    const Eigen::Array3d off = (middle - ball_.centre).array().abs();
    const double nearest = std::sqrt((off - half).max(0.0).matrix().squaredNorm());
    if (nearest > ball_.radius) return;  // disjoint from the ball
    if (whole_ <= threshold()) return settle(whole_);
    const double corner = 1.7320508075688774 * half;
    const ClosestPoint near = closest(middle);
    double bound = std::min(whole_, near.distance + corner);
    if (bound <= threshold()) return settle(bound);
    // No surface is near enough for a part of the cube to lie on its other side.
    const bool one_sided = near.distance > corner + kDistanceMargin;
    if (!outside && solid_.inside(middle)) {
      if (one_sided) return;
      bound = std::min(bound, std::max(0.0, corner - near.distance));
    } else {
      outside = one_sided;
      if (near.distance > 0) bound = std::min(bound, by_plane(middle, corner, near));
      if (off.matrix().squaredNorm() <= ball_.radius * ball_.radius)
        count(middle, near.distance);
      else if (bound > threshold())
        see(middle);
    }
    if (bound <= threshold()) return settle(bound);
    for (int k = 0; k < 8; ++k) look(middle_of_part(middle, half, k), half / 2, outside);
  }

  /// Measures how far out a point of the ball near `middle` is.
  void see(Vector3d point) {
    const Vector3d d = point - ball_.centre;
    const double length = std::sqrt(d.squaredNorm());
    if (length > ball_.radius) point = ball_.centre + d * (ball_.radius / length) * (1 - 1e-12);
    const double distance = closest(point).distance;
    if (distance > std::min(result_.least, enough_) && !solid_.inside(point))
      count(point, distance);
  }

  void count(const Vector3d& point, double distance) {
    result_.least = std::max(result_.least, distance);
    if (beyond_ != nullptr && distance > enough_) beyond_->push_back(point);
  }

  /// Bounds the distance of the ball's points in the cube from the point `near` of the solid: along
  /// the line from it to the middle they reach no further than the ball, and across it no further
  /// than the cube.
  double by_plane(const Vector3d& middle, double corner, const ClosestPoint& near) const {
    const Vector3d n = (middle - near.point) / near.distance;
    const double ahead =
        std::min(n.dot(ball_.centre - near.point) + ball_.radius, near.distance + corner);
    const double behind = near.distance - corner;
    const double along = std::max(std::abs(ahead), std::abs(behind));
    return std::sqrt(along * along + corner * corner) + kDistanceMargin;
  }

  static constexpr double kFinest = 1e-4;  ///< of the radius: smaller protrusions are not resolved

  const MeshSolid& solid_;
  const CoverSphere& ball_;
  const double tolerance_, enough_;
  std::vector<Vector3d>* const beyond_;
  double whole_ = 0;  ///< a bound for the whole ball
  BallProtrusion result_;
};

/// Points spread over the unit sphere, from a lattice on the cube, and the share of its area that
/// each represents.
struct SpherePoint {
  Vector3d direction;
  double share;
};

std::vector<SpherePoint> sphere_points(int side) {
  std::vector<SpherePoint> points;
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int sign = -1; sign <= 1; sign += 2) {
      for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
          Vector3d p;
          p[axis] = sign;
          p[(axis + 1) % 3] = (2 * i + 1.0) / side - 1;
          p[(axis + 2) % 3] = (2 * j + 1.0) / side - 1;
          const double length2 = p.squaredNorm(), length = std::sqrt(length2);
          points.push_back({p / length, 1 / (length * length2)});
          sum += points.back().share;
        }
      }
    }
  }
  for (SpherePoint& p : points) p.share /= sum;
  return points;
}

/// Volume of the union of balls, by lines along x.
double union_volume(std::span<const CoverSphere> balls, int lines) {
  Eigen::AlignedBox3d box;
  for (const CoverSphere& b : balls) {
    box.extend(b.centre + Vector3d::Constant(b.radius));
    box.extend(b.centre - Vector3d::Constant(b.radius));
  }
  const double dy = box.sizes().y() / lines, dz = box.sizes().z() / lines;
  std::vector<double> rows(static_cast<std::size_t>(lines));
  tbb::parallel_for(0, lines, [&](int iz) {
    std::vector<std::pair<double, double>> parts;
    double sum = 0;
    const double z = box.min().z() + (iz + 0.5) * dz;
    for (int iy = 0; iy < lines; ++iy) {
      const double y = box.min().y() + (iy + 0.5) * dy;
      parts.clear();
      for (const CoverSphere& b : balls) {
        const double u = y - b.centre.y(), v = z - b.centre.z();
        const double h2 = b.radius * b.radius - u * u - v * v;
        if (h2 > 0) parts.emplace_back(b.centre.x() - std::sqrt(h2), b.centre.x() + std::sqrt(h2));
      }
      std::sort(parts.begin(), parts.end());
      double to = -1e300;
      for (const auto& [low, high] : parts) {
        if (high > to) sum += high - std::max(low, to);
        to = std::max(to, high);
      }
    }
    rows[static_cast<std::size_t>(iz)] = sum;
  });
  double volume = 0;
  for (const double row : rows) volume += row;
  return volume * dy * dz;
}

}  // namespace

BallProtrusion ball_protrusion(const MeshSolid& solid, const CoverSphere& ball, double tolerance,
                               double enough) {
  return ProtrusionSearch(solid, ball, tolerance, enough, nullptr).found();
}

BallProtrusion guessed_protrusion(const MeshSolid& solid, const CoverSphere& ball, double tolerance,
                                  double enough, std::vector<Vector3d>& beyond) {
  return ProtrusionSearch(solid, ball, tolerance, enough, &beyond).found();
}

SphereProtrusion protrusion_of(const MeshSolid& solid, std::span<const CoverSphere> balls) {
  SphereProtrusion out;
  const std::size_t count = balls.size();
  if (count == 0) return out;

  // Points of the union's surface.
  const int side =
      std::clamp(static_cast<int>(std::sqrt(40000.0 / (6.0 * static_cast<double>(count)))), 4, 40);
  const std::vector<SpherePoint> pattern = sphere_points(side);
  struct Seen {
    double distance, area;
  };
  std::vector<std::vector<Seen>> seen(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const CoverSphere& ball = balls[i];
    for (const SpherePoint& p : pattern) {
      const Vector3d x = ball.centre + ball.radius * p.direction;
      bool hidden = false;
      for (std::size_t j = 0; j < count && !hidden; ++j)
        hidden = j != i && (x - balls[j].centre).squaredNorm() < balls[j].radius * balls[j].radius;
      if (hidden) continue;
      const double distance = solid.inside(x) ? 0 : solid.closest_point(x).distance;
      seen[i].push_back({distance, ball.radius * ball.radius * p.share});
    }
  });
  std::vector<Seen> all;
  for (const auto& part : seen) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(), [](const Seen& a, const Seen& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.area < b.area);
  });
  double area = 0, sum = 0;
  for (const Seen& s : all) {
    area += s.area;
    sum += s.area * s.distance;
    out.largest_seen = std::max(out.largest_seen, s.distance - kRounded);
  }
  if (area > 0) out.mean = sum / area;
  double below = 0;
  for (const Seen& s : all) {
    out.p95 = s.distance;
    below += s.area;
    if (below >= 0.95 * area) break;
  }

  // Proven, ball by ball; bounds below the largest protrusion found need not be tight.
  std::vector<BallProtrusion> each(count);
  std::size_t first = 0;
  for (std::size_t i = 0; i < count; ++i)
    for (const Seen& s : seen[i])
      if (s.distance == all.back().distance) first = i;
  each[first] = ball_protrusion(solid, balls[first], kTolerance, out.largest_seen);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    if (i != first) each[i] = ball_protrusion(solid, balls[i], kTolerance, each[first].most);
  });
  for (const BallProtrusion& p : each) {
    out.largest_seen = std::max(out.largest_seen, p.least);
    out.largest = std::max(out.largest, p.most);
  }
  out.largest = std::max(out.largest, out.largest_seen);
  out.volume_ratio = union_volume(balls, 200) / solid.unit_volume();
  return out;
}

}  // namespace ist
