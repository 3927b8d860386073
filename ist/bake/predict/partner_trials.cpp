#include "bake/predict/partner_trials.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include <ist/bake.h>
#include <ist/query.h>

#include "bake/predict/ball_part.h"
#include "bake/predict/convex_body.h"
#include "bake/predict/inner_points.h"
#include "bake/predict/trial_random.h"

namespace ist {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::size_t kPoints = 100'000;
constexpr std::uint32_t kTriesPerTrial = 6;
// Of the solid's diagonal.
constexpr double kSmallest = 0.1, kLargest = 0.3;  // diameters and edges
constexpr double kPlateThickness = 0.02;
constexpr double kPlaneReach = 4;  // half extent of the box that the plane's truth is

/// A partner turned as it will come, around the origin.
struct Shape {
  Field field;
  Pose pose;              ///< of the field
  ConvexBody body;        ///< what the truth is of
  Vector3d half_extents;  ///< [u] of a ball: its radius
};

/// Turns `from` to `to`, both of unit length, with a random turn about `to`.
Quaterniond random_turn(const Vector3d& from, const Vector3d& to, TrialRandom& random) {
  for (;;) {
    const Quaterniond spin = random.rotation();
    const Vector3d now = spin * from;
    const double scalar = 1 + now.dot(to);
    if (scalar < 1e-3) continue;
    const Vector3d axis = now.cross(to);
    const double length = std::sqrt(scalar * scalar + axis.squaredNorm());
    return Quaterniond(scalar / length, axis.x() / length, axis.y() / length, axis.z() / length) *
           spin;
  }
}

Shape box_shape(const Vector3d& half_extents, const Quaterniond& turn) {
  return {BoxField{half_extents},
          {{turn.w(), turn.x(), turn.y(), turn.z()}, {0, 0, 0}},
          ConvexBody::box(Vector3d::Zero(), turn.toRotationMatrix(), half_extents),
          half_extents};
}

Asset box_surface(const Vector3d& half) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.push_back({(corner & 1) != 0 ? half.x() : -half.x(),
                             (corner & 2) != 0 ? half.y() : -half.y(),
                             (corner & 4) != 0 ? half.z() : -half.z()});
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return bake_surface(close_mesh(std::move(mesh), "box"), {}, 1);
}

Shape shape_of(TrialPartner partner, double diagonal, const Vector3d& direction,
               TrialRandom& random) {
  const double size = diagonal * (kSmallest + (kLargest - kSmallest) * random.uniform());
  const Vector3d cube = Vector3d::Constant(size / 2);
  const auto turned = [&](const Vector3d& lead) {
    return random_turn(lead.normalized(), -direction, random);
  };
  switch (partner) {
    case TrialPartner::plane: {
      const double reach = kPlaneReach * diagonal;
      Shape shape = box_shape(Vector3d::Constant(reach), turned({0, 0, 1}));
      shape.field = HalfSpaceField{Vector3d::UnitZ(), reach};
      return shape;
    }
    case TrialPartner::ball:
      return {BallField{size / 2},
              {},
              ConvexBody::ball(Vector3d::Zero(), size / 2),
              Vector3d::Constant(size / 2)};
    case TrialPartner::edge:
      return box_shape(cube, turned({1, 1, 0}));
    case TrialPartner::corner:
      return box_shape(cube, turned({1, 1, 1}));
    default:
      return box_shape({size / 2, size / 2, kPlateThickness * diagonal / 2}, random.rotation());
  }
}

/// How far from `target` along `direction` a body that comes from there first holds `wanted` of
/// the points, in lengths of `direction`.
std::optional<double> way_of(const ConvexBody& body, const std::vector<Vector3d>& points,
                             const Vector3d& target, const Vector3d& direction,
                             std::size_t wanted) {
  std::vector<std::pair<double, int>> events;  // on the way in: a point comes in, or is left behind
  for (const Vector3d& x : points)
    if (const auto part = body.part_of(x - target, -direction)) {
      events.emplace_back(part->to, 1);
      events.emplace_back(part->from, -1);
    }
  std::sort(events.begin(), events.end(), std::greater<>());
  std::size_t held = 0;
  for (const auto& [way, change] : events)
    if (change < 0) {
      --held;
    } else if (++held >= wanted) {
      return way;
    }
  return std::nullopt;
}

}  // namespace

PartnerTrials::PartnerTrials(const MeshSolid& solid, const TreeView& mesh)
    : solid_(solid),
      mesh_(mesh),
      points_(inner_points(solid, kPoints)),
      diagonal_(solid.bounds().diagonal().norm()) {}

std::vector<PartnerTrial> PartnerTrials::find(TrialPartner partner, double overlap,
                                              std::uint32_t count, std::uint64_t seed,
                                              const std::function<bool(double)>& go_on) const {
  TrialRandom random(seed + static_cast<std::uint64_t>(partner));
  std::vector<PartnerTrial> trials;
  Workspace workspace;
  PenetrationSettings exact;
  exact.measure = Measure::exact;
  const auto go = [&] {
    return !go_on || go_on(static_cast<double>(trials.size()) / static_cast<double>(count));
  };
  for (std::uint32_t i = 0; i < kTriesPerTrial * count && trials.size() < count; ++i) {
    if (points_.empty() || !go()) break;
    const double volume = random_in_decade(overlap / kHalfDecade, random) * solid_.volume();
    const Vector3d target = points_[random.bits() % points_.size()];
    const Vector3d direction = random.direction();
    const Shape shape = shape_of(partner, diagonal_, direction, random);
    constexpr double kMostHeld = 0.5;
    if (volume > kMostHeld * std::min(solid_.volume(), shape.body.volume())) continue;
    const double share = volume / solid_.volume();
    const auto wanted =
        static_cast<std::size_t>(std::ceil(share * static_cast<double>(points_.size())));
    const auto way = way_of(shape.body, points_, target, direction, wanted);
    if (!way) continue;
    const Vector3d place = target + *way * direction;
    Pose pose = shape.pose;
    for (int k = 0; k < 3; ++k) pose.t[k] = place[k];
    double truth = 0;
    if (partner == TrialPartner::ball) {
      truth = ball_part(solid_, place, shape.half_extents.x());
    } else {
      const Asset box = box_surface(shape.half_extents);
      truth = penetration({mesh_, {}, 1}, {box.view(), pose, 1}, exact, workspace).volume;
    }
    const double found = truth / solid_.volume();
    if (!(found >= overlap / kHalfDecade && found <= overlap * kHalfDecade)) continue;
    trials.push_back({{shape.field, pose, 1}, truth});
  }
  return trials;
}

}  // namespace ist
