#include "bake/predict/partner_trials.h"

#include <ist/bake.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "bake/predict/trial_poses.h"
#include "mesh/hierarchy/line_lattice.h"
#include "query/ball_triangle/patch_sums.h"

namespace ist {
namespace {

struct LinePart {
  double from = 0, to = 0;  ///< in lengths of the line's direction, from < to
};

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A ball or a box, whose intersections with lines are exact.
class ConvexBody {
 public:
  /// `radius` > 0, [u].
  static ConvexBody ball(const Vector3d& centre, double radius) {
    ConvexBody body;
    body.centre_ = centre;
    body.half_extents_ = Vector3d::Constant(radius);
    body.round_ = true;
    return body;
  }

  /// Half extents > 0, [u], along the columns of `axes`, a rotation.
  static ConvexBody box(const Vector3d& centre, const Matrix3d& axes,
                        const Vector3d& half_extents) {
    ConvexBody body;
    body.centre_ = centre;
    body.axes_ = axes;
    body.half_extents_ = half_extents;
    return body;
  }

  /// The part of the line {origin + t · direction} that lies inside, if any.
  std::optional<LinePart> part_of(const Vector3d& origin, const Vector3d& direction) const {
    const Vector3d from_centre = origin - centre_;
    if (round_) {
      const double length2 = direction.squaredNorm(), along = from_centre.dot(direction);
      const double radius = half_extents_.x();
      const double inside = along * along - length2 * (from_centre.squaredNorm() - radius * radius);
      if (!(inside > 0)) return std::nullopt;
      const double half = std::sqrt(inside);
      return LinePart{(-along - half) / length2, (-along + half) / length2};
    }
    LinePart part = {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
    for (int k = 0; k < 3; ++k) {
      const double at = axes_.col(k).dot(from_centre), step = axes_.col(k).dot(direction);
      const double half = half_extents_[k];
      constexpr double kParallel = 1e-12;
      if (std::abs(step) < kParallel) {
        if (std::abs(at) >= half) return std::nullopt;
        continue;
      }
      double enters = (-half - at) / step, leaves = (half - at) / step;
      if (step < 0) std::swap(enters, leaves);
      part.from = std::max(part.from, enters);
      part.to = std::min(part.to, leaves);
    }
    if (!(part.from < part.to)) return std::nullopt;
    return part;
  }

  double volume() const {
    const double box = 8 * half_extents_.prod();
    return round_ ? std::numbers::pi / 6 * box : box;
  }

 private:
  ConvexBody() = default;

  Eigen::Vector3d centre_;
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d half_extents_;  ///< of a ball: its radius, three times
  bool round_ = false;
};

using Eigen::Quaterniond;

constexpr std::size_t kPoints = 100'000;
constexpr std::uint32_t kTriesPerTrial = 6;
// Fractions of the solid's diagonal.
constexpr double kSmallest = 0.1, kLargest = 0.3;  // diameters and edges
constexpr double kPlateThickness = 0.02;
constexpr double kPlaneReach = 4;  // half extent of the box whose exact volume represents the plane

/// A rotated partner, around the origin.
struct TrialShape {
  Shape field;
  Pose pose;              ///< of the field
  ConvexBody body;        ///< whose exact volume is computed
  Vector3d half_extents;  ///< [u] for a ball: its radius
};

/// Rotates `from` to `to`, both of unit length, with a random rotation about `to`.
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

TrialShape box_shape(const Vector3d& half_extents, const Quaterniond& turn) {
  return {BoxShape{half_extents},
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
  return bake_mesh_only(close_mesh(std::move(mesh), "box"), 1);
}

TrialShape shape_of(TrialPartner partner, double diagonal, const Vector3d& direction,
                    TrialRandom& random) {
  const double size = diagonal * (kSmallest + (kLargest - kSmallest) * random.uniform());
  const Vector3d cube = Vector3d::Constant(size / 2);
  const auto turned = [&](const Vector3d& lead) {
    return random_turn(lead.normalized(), -direction, random);
  };
  switch (partner) {
    case TrialPartner::plane: {
      const double reach = kPlaneReach * diagonal;
      TrialShape shape = box_shape(Vector3d::Constant(reach), turned({0, 0, 1}));
      shape.field = HalfSpaceShape{Vector3d::UnitZ(), reach};
      return shape;
    }
    case TrialPartner::ball:
      return {BallShape{size / 2},
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

/// The distance from `target` along `direction`, in lengths of `direction`, at which an approaching
/// body first contains `wanted` of the points.
std::optional<double> travel_of(const ConvexBody& body, const std::vector<Vector3d>& points,
                                const Vector3d& target, const Vector3d& direction,
                                std::size_t wanted) {
  // Events of the approach: a point enters (1) or leaves (−1).
  std::vector<std::pair<double, int>> events;
  for (const Vector3d& x : points)
    if (const auto part = body.part_of(x - target, -direction)) {
      events.emplace_back(part->to, 1);
      events.emplace_back(part->from, -1);
    }
  std::sort(events.begin(), events.end(), std::greater<>());
  std::size_t held = 0;
  for (const auto& [travel, change] : events)
    if (change < 0) {
      --held;
    } else if (++held >= wanted) {
      return travel;
    }
  return std::nullopt;
}

}  // namespace

std::vector<Vector3d> inner_points(const MeshSolid& solid, std::size_t count) {
  constexpr double kMostLines = 1024;  // on a side
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const Vector3d low = solid.frame().to_unit(bounds.min());
  const Vector3d sizes = solid.frame().to_unit(bounds.max()) - low;
  const double step = std::cbrt(solid.unit_volume() / static_cast<double>(count));
  const auto lines = [&](double size) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil(size / step), 1.0, kMostLines));
  };
  LineLattice lattice;
  lattice.y0 = low.y();
  lattice.z0 = low.z();
  lattice.ny = lines(sizes.y());
  lattice.nz = lines(sizes.z());
  lattice.step_y = sizes.y() / lattice.ny;
  lattice.step_z = sizes.z() / lattice.nz;
  lattice.offset = kGoldenRatio / 2;
  lattice.shift = kGoldenRatio;
  // The spacing along the lines that gives each point the volume of a cell of the wanted step.
  const double along = step * step * step / (lattice.step_y * lattice.step_z);
  std::vector<Vector3d> points;
  double turned = 0;  // of the first point of a line, over the step
  cross_lattice(solid.arrays(), lattice, [&](std::uint32_t row, const LatticeCrossings& cut) {
    for (std::size_t line = 0; line < cut.size(); ++line) {
      const auto i = static_cast<std::uint32_t>(line % lattice.ny);
      const auto j = row + static_cast<std::uint32_t>(line / lattice.ny);
      turned += kGoldenRatio;
      turned -= std::floor(turned);
      int winding = 0;
      double since = 0;
      for (const Crossing& crossing : cut[line]) {
        if (winding >= 1)
          for (double k = std::ceil((since - low.x()) / along - turned);
               low.x() + (k + turned) * along < crossing.x; ++k)
            points.push_back(solid.frame().from_unit(
                {low.x() + (k + turned) * along, lattice.y(i, j), lattice.z(j)}));
        winding += crossing.sign;
        since = crossing.x;
      }
    }
  });
  return points;
}

double ball_part(const MeshSolid& solid, const Vector3d& centre, double radius) {
  const MeshView& mesh = solid.arrays();
  const Vector3d at = solid.frame().to_unit(centre);
  ProbeBalls one = {};
  one.r[0] = one.reach = radius / solid.frame().scale();
  for (int k = 0; k < 3; ++k) one.origin[k] = at[k];
  const auto add = [&](const ProbeBalls& balls, ProbeSums& sums) {
    for (std::uint32_t first = 0; first < mesh.triangle_count; first += kWidth) {
      TriangleCorners corners = {};
      const std::uint32_t count = std::min(kWidth, mesh.triangle_count - first);
      for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t c = 0; c < 3; ++c) {
          const double* const x =
              mesh.vertices + std::size_t{3} * mesh.triangles[std::size_t{3} * (first + i) + c];
          corners.x[c][i] = x[0];
          corners.y[c][i] = x[1];
          corners.z[c][i] = x[2];
        }
      SurfacePatch patch;
      make_patch(corners, patch);
      const std::uint32_t near = triangles_near(patch, balls.origin, balls.reach);
      if (near != 0) add_patch(patch, near, balls, 1, sums);
    }
  };
  ProbeSums sums;
  add(one, sums);
  off_edges(one, sums, add);
  const double r = one.r[0], whole = 4 * std::numbers::pi / 3 * (r * r * r);
  const double held = solid.inside(at) ? whole : 0;
  const double volume = std::clamp(held + ((sums.met & 1) != 0 ? sums.cones[0] : 0), 0.0, whole);
  const double unit = solid.frame().scale();
  return volume * (unit * unit * unit);
}

PartnerTrials::PartnerTrials(const MeshSolid& solid, const AssetView& mesh)
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
  const PenetrationSettings exact = {.measure = Measure::exact};
  const auto go = [&] {
    return !go_on || go_on(static_cast<double>(trials.size()) / static_cast<double>(count));
  };
  for (std::uint32_t i = 0; i < kTriesPerTrial * count && trials.size() < count; ++i) {
    if (points_.empty() || !go()) break;
    const double volume = random_in_decade(overlap / kHalfDecade, random) * solid_.volume();
    const Vector3d target = points_[random.bits() % points_.size()];
    const Vector3d direction = random.direction();
    const TrialShape shape = shape_of(partner, diagonal_, direction, random);
    constexpr double kMostHeld = 0.5;
    if (volume > kMostHeld * std::min(solid_.volume(), shape.body.volume())) continue;
    const double share = volume / solid_.volume();
    const auto wanted =
        static_cast<std::size_t>(std::ceil(share * static_cast<double>(points_.size())));
    const auto travel = travel_of(shape.body, points_, target, direction, wanted);
    if (!travel) continue;
    const Vector3d place = target + *travel * direction;
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
