#include <ist/raycast.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>

#include "query/base/no_answer.h"
#include "query/base/relative_pose.h"
#include "query/exact/kept_mesh.h"
#include "query/exact/mesh_queries.h"
#include "query/shape/patch_shapes.h"

namespace ist {
namespace {

using Eigen::Vector3d;

template <class Answer>
Answer refused(QueryStatus status) noexcept {
  const Vector3d none = Vector3d::Constant(kNone);
  if constexpr (std::is_same_v<Answer, RayHit>)
    return {kNone, none, none, ~0u, status};
  else if constexpr (std::is_same_v<Answer, SurfacePoint>)
    return {kNone, kNone, none, none, ~0u, status};
  else
    return {YesNo::unknown, status};
}

/// An asset's unit frame, or a shape's own frame.
struct SolidFrame {
  Eigen::Matrix3d rotation;
  Vector3d origin;  ///< [u] world
  double unit;      ///< [u]

  static std::optional<SolidFrame> of(const Pose& pose, double scale, const Vector3d& offset,
                                      int exponent) noexcept {
    const std::optional<Eigen::Quaterniond> turn = usable_rotation(pose, scale);
    if (!turn || !ratio_in_range(scale)) return std::nullopt;
    const Eigen::Matrix3d rotation = turn->toRotationMatrix();
    return SolidFrame{rotation, vector(pose.t) + rotation * (scale * offset),
                      std::ldexp(scale, exponent)};
  }
  Vector3d world(const Vector3d& x) const noexcept { return rotation * (unit * x) + origin; }
  /// Empty if the point is out of range or not finite.
  std::optional<Vector3d> own(const Vector3d& world) const noexcept {
    const Vector3d x = rotation.transpose() * (world - origin) / unit;
    return in_pose_range(plain(x)) ? std::optional(x) : std::nullopt;
  }
};

exact::Point point(const Vector3d& x) noexcept { return {x.x(), x.y(), x.z()}; }

/// A ray in a solid's own frame.
struct OwnRay {
  Vector3d origin;
  Vector3d direction;  ///< unit
  double max_distance;

  static std::optional<OwnRay> of(const Ray& ray, const SolidFrame& frame) noexcept {
    const double largest = ray.direction.cwiseAbs().maxCoeff();
    const std::optional<Vector3d> origin = frame.own(ray.origin);
    if (!origin || !(largest > 0) || !ray.direction.allFinite() || !(ray.max_distance > 0))
      return std::nullopt;
    // A power of two keeps all digits; in two halves neither it nor a square overflows.
    const int exponent = std::ilogb(largest);
    const Vector3d scaled = ray.direction.unaryExpr([&](double x) {
      return std::ldexp(std::ldexp(x, -exponent / 2), exponent / 2 - exponent);
    });
    return OwnRay{*origin, (frame.rotation.transpose() * scaled).normalized(),
                  std::min(ray.max_distance, kFarthestPose) / frame.unit};
  }
};

RayHit hit_at(const SolidFrame& frame, const OwnRay& ray, double distance, const Vector3d& normal,
              std::uint32_t triangle) noexcept {
  return {frame.unit * distance, frame.world(ray.origin + distance * ray.direction),
          (frame.rotation * normal).normalized(), triangle, QueryStatus::ok};
}

class MeshOfSolid {
 public:
  explicit MeshOfSolid(const PlacedAsset& placed) noexcept {
    if (placed.asset.empty()) return;
    if (!keeps_mesh(placed)) {
      status_ = QueryStatus::missing_data;
      return;
    }
    const AssetHeader& asset = placed.asset.header();
    frame_ = SolidFrame::of(placed.pose, placed.scale, vector(asset.centre), asset.exponent);
    if (!frame_) return;
    mesh_.emplace(mesh_of(placed));
    extent_ = mesh_->extent();
    status_ = QueryStatus::ok;
  }

  RayHit answer(const Ray& given) const noexcept {
    if (status_ != QueryStatus::ok) return refused<RayHit>(status_);
    const std::optional<OwnRay> ray = OwnRay::of(given, *frame_);
    if (!ray) return refused<RayHit>(QueryStatus::invalid_input);
    // The whole mesh is within this distance.
    const double length = std::min(ray->max_distance, ray->origin.cwiseAbs().sum() + 4 * extent_);
    const Vector3d end = ray->origin + length * ray->direction;
    const MeshHit hit =
        end == ray->origin ? MeshHit() : first_hit(*mesh_, point(ray->origin), point(end));
    if (hit.triangle == ~0u) return {};
    return hit_at(*frame_, *ray, hit.t * length, vector(hit.normal).normalized(), hit.triangle);
  }

  SurfacePoint answer(const Vector3d& given, SurfacePoint) const noexcept {
    if (status_ != QueryStatus::ok) return refused<SurfacePoint>(status_);
    const std::optional<Vector3d> x = frame_->own(given);
    if (!x) return refused<SurfacePoint>(QueryStatus::invalid_input);
    const MeshFoot foot = nearest_on(*mesh_, point(*x));
    const double away = std::sqrt(foot.squared);
    const double side = is_inside({*mesh_}, point(*x)) ? -1 : 1;
    // Very close to the surface the direction to it is mostly rounding.
    const double rounding =
        1e-14 * (extent_ + away) + 1e-15 * (frame_->origin.norm() + given.norm()) / frame_->unit;
    const Vector3d gradient =
        away > rounding ? side / away * (*x - vector(foot.at)) : vector(foot.normal).normalized();
    return {side * away * frame_->unit,
            frame_->unit * (moved_in_mesh(*mesh_) + rounding),
            frame_->world(vector(foot.at)),
            (frame_->rotation * gradient).normalized(),
            foot.triangle,
            QueryStatus::ok};
  }

  YesNoAnswer answer(const Vector3d& given, YesNoAnswer) const noexcept {
    if (status_ != QueryStatus::ok) return refused<YesNoAnswer>(status_);
    const std::optional<Vector3d> x = frame_->own(given);
    if (!x) return refused<YesNoAnswer>(QueryStatus::invalid_input);
    return {is_inside({*mesh_}, point(*x)) ? YesNo::yes : YesNo::no, QueryStatus::ok};
  }

 private:
  QueryStatus status_ = QueryStatus::invalid_input;
  std::optional<SolidFrame> frame_;
  std::optional<MeshTree> mesh_;
  double extent_ = 0;
};

/// The part of a line that lies in a convex solid.
struct Chord {
  double first = -HUGE_VAL, last = HUGE_VAL;

  static Chord none() noexcept { return {HUGE_VAL, -HUGE_VAL}; }
  bool empty() const noexcept { return !(first <= last); }
  Chord within(const Chord& other) const noexcept {
    return {std::max(first, other.first), std::min(last, other.last)};
  }
  /// The union of two chords; the union of their solids must be convex.
  Chord with(const Chord& other) const noexcept {
    if (empty() || other.empty()) return empty() ? other : *this;
    return {std::min(first, other.first), std::max(last, other.last)};
  }
};

/// The chord with x + t d ≤ most.
Chord below(double x, double d, double most) noexcept {
  constexpr double kLeast = 1e-150;
  if (std::abs(d) < kLeast) return x <= most ? Chord() : Chord::none();
  const double t = (most - x) / d;
  return d > 0 ? Chord{-HUGE_VAL, t} : Chord{t, HUGE_VAL};
}
Chord between(double x, double d, double half) noexcept {
  return below(x, d, half).within(below(-x, -d, half));
}
/// The chord with |x + t d| ≤ radius.
Chord within_radius(const Vector3d& x, const Vector3d& d, double radius) noexcept {
  const double dd = d.squaredNorm();
  if (!(dd > 1e-150)) return x.norm() <= radius ? Chord() : Chord::none();
  const double middle = -x.dot(d) / dd;
  const double beside = (x + middle * d).norm();
  if (beside > radius) return Chord::none();
  const double half = std::sqrt((radius - beside) * (radius + beside) / dd);
  return {middle - half, middle + half};
}

Chord chord_of(const HalfSpaceSampler& s, const Vector3d& x, const Vector3d& d) noexcept {
  const Vector3d normal(s.normal);
  return below(normal.dot(x), normal.dot(d), s.offset);
}
Chord chord_of(const BoxSampler& s, const Vector3d& x, const Vector3d& d) noexcept {
  Chord chord;
  for (int k = 0; k < 3; ++k) chord = chord.within(between(x[k], d[k], s.half[k]));
  return chord;
}
Chord chord_of(const BallSampler& s, const Vector3d& x, const Vector3d& d) noexcept {
  return within_radius(x, d, s.radius);
}
Chord chord_of(const CylinderSampler& s, const Vector3d& x, const Vector3d& d) noexcept {
  return within_radius({x.x(), x.y(), 0}, {d.x(), d.y(), 0}, s.radius)
      .within(between(x.z(), d.z(), s.half));
}
Chord chord_of(const CapsuleSampler& s, const Vector3d& x, const Vector3d& d) noexcept {
  const Vector3d end(0, 0, s.half);
  return within_radius({x.x(), x.y(), 0}, {d.x(), d.y(), 0}, s.radius)
      .within(between(x.z(), d.z(), s.half))
      .with(within_radius(x - end, d, s.radius))
      .with(within_radius(x + end, d, s.radius));
}

template <class Sampler>
RayHit shape_hit(Sampler& shape, const SolidFrame& frame, const OwnRay& ray) noexcept {
  if constexpr (requires { chord_of(shape, ray.origin, ray.origin); }) {
    const Chord chord = chord_of(shape, ray.origin, ray.direction);
    const double distance = chord.first >= 0 ? chord.first : chord.last;
    if (chord.empty() || !(distance >= 0) || !(distance <= ray.max_distance)) return {};
    const Vector3d at = ray.origin + distance * ray.direction;
    return hit_at(frame, ray, distance, shape.nearest(at).gradient, ~0u);
  } else {
    return refused<RayHit>(QueryStatus::missing_data);
  }
}

class ShapeAtPose {
 public:
  explicit ShapeAtPose(const PlacedShape& placed) noexcept
      : shape_(placed.shape),
        frame_(SolidFrame::of(placed.pose, placed.scale, Vector3d::Zero(), 0)) {}

  RayHit answer(const Ray& given) const noexcept {
    const auto refuse = [] { return refused<RayHit>(QueryStatus::invalid_input); };
    if (!frame_) return refuse();
    const std::optional<OwnRay> ray = OwnRay::of(given, *frame_);
    if (!ray) return refuse();
    return with_shape(
        shape_, [&](auto& shape) { return shape_hit(shape, *frame_, *ray); }, refuse);
  }

  SurfacePoint answer(const Vector3d& given, SurfacePoint) const noexcept {
    return with_sample<SurfacePoint>(
        given, [&](const Vector3d& x, const ShapeSample& at, double error) {
          // In a centre of symmetry any direction serves.
          const double slope = at.gradient.norm();
          const Vector3d gradient =
              slope > 0 ? Vector3d(at.gradient / slope) : Vector3d::UnitX().eval();
          const double rounding = 1e-15 * (x.norm() + std::abs(at.distance)) +
                                  1e-15 * (frame_->origin.norm() + given.norm()) / frame_->unit;
          return SurfacePoint{at.distance * frame_->unit,
                              frame_->unit * (error + rounding),
                              frame_->world(x - at.distance * gradient),
                              frame_->rotation * gradient,
                              ~0u,
                              QueryStatus::ok};
        });
  }

  YesNoAnswer answer(const Vector3d& given, YesNoAnswer) const noexcept {
    return with_sample<YesNoAnswer>(given, [](const Vector3d&, const ShapeSample& at, double) {
      return YesNoAnswer{at.distance < 0 ? YesNo::yes : YesNo::no, QueryStatus::ok};
    });
  }

 private:
  template <class Answer, class Use>
  Answer with_sample(const Vector3d& given, const Use& use) const noexcept {
    const auto refuse = [] { return refused<Answer>(QueryStatus::invalid_input); };
    if (!frame_) return refuse();
    const std::optional<Vector3d> x = frame_->own(given);
    if (!x) return refuse();
    return with_shape(
        shape_, [&](auto& shape) { return use(*x, shape.nearest(*x), shape.error()); }, refuse);
  }

  const Shape& shape_;
  std::optional<SolidFrame> frame_;
};

template <class Asked, class Answer, class... Kind>
void answer_all(const PlacedSolid& placed, std::span<const Asked> asked, std::span<Answer> answers,
                Kind... kind) noexcept {
  const auto answer = [&](const auto& solid) {
    for (std::size_t i = 0; i < std::min(asked.size(), answers.size()); ++i)
      answers[i] = solid.answer(asked[i], kind...);
  };
  if (const auto* const asset = std::get_if<PlacedAsset>(&placed.placed))
    answer(MeshOfSolid(*asset));
  else
    answer(ShapeAtPose(*std::get_if<PlacedShape>(&placed.placed)));
}

template <class Asked, class Answer, class... Kind>
Answer answer_one(const PlacedSolid& placed, const Asked& asked, Answer answer,
                  Kind... kind) noexcept {
  answer_all(placed, std::span(&asked, 1), std::span(&answer, 1), kind...);
  return answer;
}

}  // namespace

RayHit raycast(const PlacedSolid& solid, const Ray& ray) noexcept {
  return answer_one(solid, ray, RayHit());
}
SurfacePoint closest_point(const PlacedSolid& solid, const Vector3d& point) noexcept {
  return answer_one(solid, point, SurfacePoint(), SurfacePoint());
}
YesNoAnswer contains(const PlacedSolid& solid, const Vector3d& point) noexcept {
  return answer_one(solid, point, YesNoAnswer(), YesNoAnswer());
}

void raycast(const PlacedSolid& solid, std::span<const Ray> rays,
             std::span<RayHit> answers) noexcept {
  answer_all(solid, rays, answers);
}
void closest_point(const PlacedSolid& solid, std::span<const Vector3d> points,
                   std::span<SurfacePoint> answers) noexcept {
  answer_all(solid, points, answers, SurfacePoint());
}
void contains(const PlacedSolid& solid, std::span<const Vector3d> points,
              std::span<YesNoAnswer> answers) noexcept {
  answer_all(solid, points, answers, YesNoAnswer());
}

}  // namespace ist
