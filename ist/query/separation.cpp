#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <ist/query.h>

#include "base/bits.h"
#include "query/asset/sphere_tree.h"
#include "query/base/budget.h"
#include "query/base/no_answer.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/exact/kept_mesh.h"
#include "query/exact/mesh_distance.h"
#include "query/exact/mesh_gap.h"
#include "query/kernel/gap_kernel.h"
#include "query/scratch/workspace.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

/// A pair of spheres, A's unit frame.
struct SpherePair {
  double gap = std::numeric_limits<double>::infinity();
  Eigen::Vector3d centre_a = Eigen::Vector3d::Zero(), centre_b = Eigen::Vector3d::Zero();
  double radius_a = 0, radius_b = 0;
};

/// The gap between the inner spheres of two trees and, if `covers`, that of their cover balls.
/// Prunes pairs beyond the limit. All in A's unit frame, gap_ in the kernel's precision.
class GapDescent : GapStack {
 public:
  GapDescent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
             std::uint32_t most_visits, double limit, bool covers, Workspace::Impl& scratch)
      : GapStack(scratch, most_visits, limit, covers ? limit : 0),
        a_(a),
        b_(b),
        a_side_(a, b, pose.a_from_b, precision_for_gap(a.root(), b.root(), pose.a_from_b)),
        b_side_(b, a, pose.b_from_a, a_side_.precision),
        scale_(pose.a_from_b.scale) {}

  void run() {
    measure(a_.sphere(0, 0), b_.sphere(0, 0));
    if (root_gap() > gap_) return;
    gap_ = std::min(gap_, nearest_.gap);
    stopped_ = search(
        {0, 0, 0, 0, a_.top, b_.top},
        [&](const WaitingPair& pair) {
          pair.level_a == 0 && pair.level_b == 0 ? open_leaves(pair) : open_node(pair);
        },
        [&] { return overlap_; });
  }

  bool overlap() const { return overlap_; }
  bool stopped() const { return stopped_; }
  const SpherePair& nearest() const { return nearest_; }
  double cover() const { return cover_; }
  Precision precision() const { return a_side_.precision; }
  std::uint32_t visits() const { return budget_.visits(); }
  std::uint32_t pairs() const { return pairs_; }

 private:
  /// The gap of the roots, of the balls that count.
  double root_gap() const {
    const auto root_a = a_.root(), root_b = b_.root();
    const double between =
        (mapped(*a_side_.x_from_y, root_b.centre) - vector(root_a.centre)).norm();
    return between -
           (cover_ > 0 ? root_a.reach() + scale_ * root_b.reach() : root_a.r + scale_ * root_b.r);
  }

  double cover_limit() const {
    return cover_ > 0 ? cover_ : -std::numeric_limits<double>::infinity();
  }

  void open_node(const WaitingPair& pair) {
    const TreeNode node_a{pair.level_a, pair.a}, node_b{pair.level_b, pair.b};
    const double radius_a = a_.ball(node_a).r, radius_b = scale_ * b_.ball(node_b).r;
    const bool open_a = pair.level_b == 0 || (pair.level_a > 0 && radius_a >= radius_b);
    // In the unit frame of the side that is opened.
    const GapSide& side = open_a ? a_side_ : b_side_;
    const TreeNode opened = open_a ? node_a : node_b;
    const double unit = open_a ? 1 : scale_;
    const double other_radius = (open_a ? radius_b : radius_a) / unit;
    ChildGaps gaps;
    child_gaps(side, opened, open_a ? node_b : node_a, gap_ / unit, cover_limit() / unit, gaps);
    const std::uint32_t below = side.x->count(opened.level - 1) - kWidth * opened.block;
    const float* const radii = side.x->level[opened.level].blocks[opened.block].r;
    // Unused lanes are excluded by number: for solids far enough apart no radius would exclude
    // them.
    const std::uint32_t used = (1u << std::min(kWidth, below)) - 1;
    for (const std::uint32_t lane : set_bits(gaps.near & used)) {
      WaitingPair child = pair;
      child.gap = unit * gaps.gap[lane];
      child.cover = unit * gaps.cover[lane];
      if (!wanted(child.gap, child.cover)) continue;
      (open_a ? child.a : child.b) = kWidth * opened.block + lane;
      --(open_a ? child.level_a : child.level_b);
      // The nearest child comes on top; among balls that overlap, the one that overlaps most for
      // its size, since its spheres are the most likely to overlap.
      child.order =
          child.gap < 0 ? child.gap / (unit * (double{radii[lane]} + other_radius)) : child.gap;
      add(child);
    }
  }

  void open_leaves(const WaitingPair& pair) {
    const LeafGap leaf = leaf_gap(a_side_, pair.a, pair.b, gap_, cover_limit());
    pairs_ += kWidth * kWidth;
    if (cover_ > 0) cover_ = std::min(cover_, leaf.cover);
    if (leaf.gap >= gap_) return;
    gap_ = leaf.gap;
    measure(a_.sphere(pair.a, leaf.lane_x), b_.sphere(pair.b, leaf.lane_y));
  }

  /// Computes a pair of inner spheres in double: any gap is an upper bound on the distance.
  void measure(const NodeBall& sphere_a, const NodeBall& sphere_b) {
    const Eigen::Vector3d xa = vector(sphere_a.centre);
    const Eigen::Vector3d xb = mapped(*a_side_.x_from_y, sphere_b.centre);
    const double radius_b = scale_ * sphere_b.r;
    const double gap = ((xb - xa).norm() - sphere_a.r) - radius_b;
    if (gap >= nearest_.gap) return;
    nearest_ = {gap, xa, xb, sphere_a.r, radius_b};
    overlap_ = gap <= 0;
  }

  const SphereTree& a_;
  const SphereTree& b_;
  const GapSide a_side_, b_side_;
  const double scale_;
  SpherePair nearest_;
  std::uint32_t pairs_ = 0;
  bool overlap_ = false;
  bool stopped_ = false;
};

/// True if a sphere of a tree is found that contains a point at least `margin` deep, unit frame.
/// May miss one, as it opens few nodes: those that contain the point most deeply first.
bool finds_sphere_around(const SphereTree& tree, const Eigen::Vector3d& point, double margin) {
  constexpr int kMostVisits = 16;
  struct Waiting {
    int level;
    std::uint32_t block;
    float depth;
  };
  Waiting stack[kWidth * (kMaxLevels + 1)];  // uninitialised: that would take as long as the rest
  stack[0] = {tree.top, 0, 0};
  std::size_t size = 1;
  for (int visit = 0; visit < kMostVisits && size > 0; ++visit) {
    const auto [level, block, depth] = stack[--size];
    const BallBlock& balls = tree.level[level].blocks[block];
    const Origin& origin = tree.level[level].origins[block];
    const float at[3] = {static_cast<float>(point.x() - origin.x),
                         static_cast<float>(point.y() - origin.y),
                         static_cast<float>(point.z() - origin.z)};
    float inside[kWidth];
    const std::size_t first = size, below = tree.count(level - 1) - std::size_t{kWidth} * block;
    const std::uint32_t used = (1u << std::min<std::size_t>(kWidth, below)) - 1;
    for (const std::uint32_t k : set_bits(balls_around(balls, at, inside) & used)) {
      if (level == 0) {
        const NodeBall sphere = tree.sphere(block, k);
        if ((vector(sphere.centre) - point).norm() < sphere.r - margin) return true;
        continue;
      }
      const Waiting child = {level - 1, kWidth * block + k, inside[k] / (balls.r[k] * balls.r[k])};
      std::size_t place = size++;
      for (; place > first && stack[place - 1].depth > child.depth; --place)
        stack[place] = stack[place - 1];
      stack[place] = child;
    }
  }
  return false;
}

class InnerSpheres {
 public:
  InnerSpheres(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose)
      : a(sphere_tree(a.asset, Measure::inner)),
        b(sphere_tree(b.asset, Measure::inner)),
        off(distance_error(Precision::float64,
                           span(this->a.root(), this->b.root(), pose.a_from_b)) +
            pose.rounding_of_world()),
        pose_(pose) {}

  const SphereTree a, b;
  const double off;  ///< bound on the rounding of points, A's unit frame

  /// True if spheres of both are found around a point of A's unit frame, so that the solids
  /// overlap.
  bool share(const Eigen::Vector3d& point) const {
    return finds_sphere_around(a, point, off) &&
           finds_sphere_around(b, mapped(pose_.b_from_a, {point.x(), point.y(), point.z()}),
                               off / pose_.a_from_b.scale);
  }

  /// The same for the middle of the overlap of the balls around them. Solids that fill these balls
  /// mostly share it.
  bool share_the_middle() const {
    constexpr double kFull = 0.25;
    const auto is_full = [](const SphereTree& tree) {
      return tree.sums(tree.top, 0).volume > kFull * ball_volume(tree.root().r);
    };
    return is_full(a) && is_full(b) && share(middle_of_balls());
  }

 private:
  Eigen::Vector3d middle_of_balls() const {
    const RootBall root_a = a.root(), root_b = b.root();
    const Eigen::Vector3d centre = vector(root_a.centre);
    const Eigen::Vector3d between = mapped(pose_.a_from_b, root_b.centre) - centre;
    const double length = between.norm(), r = pose_.a_from_b.scale * root_b.r;
    if (!(length > 0)) return centre;
    const double low = std::max(length - r, -root_a.r), high = std::min(root_a.r, length + r);
    return centre + (low + high) / (2 * length) * between;
  }

  const RelativePose& pose_;
};

/// The gap between the meshes of two assets.
class SurfaceGap {
 public:
  SurfaceGap(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
             const SeparationSettings& settings, double enough, Workspace::Impl& scratch)
      : a_(a),
        b_(b),
        pose_(pose),
        settings_(settings),
        scratch_(scratch),
        mesh_a_(mesh_of(a)),
        mesh_b_(mesh_of(b)),
        simplified_(mesh_a_.header->error + pose.a_from_b.scale * mesh_b_.header->error),
        error_(gap_error(mesh_a_, mesh_b_, pose, moved_by_poses(a, b, mesh_b_, pose))) {
    if (settings.max_distance > 0) question_.most = settings.max_distance / pose.unit_a + error_;
    if (enough > 0) question_.enough = enough / pose.unit_a - error_;
    if (settings.pair_id != 0 && settings.max_visits == 0) {
      KeptPairs& kept = scratch.exact.near.of(settings.pair_id, mesh_a_, mesh_b_, pose.a_from_b);
      question_.kept = &kept;
      const double apart = std::exchange(kept.apart, 0);
      // If the surfaces cannot have touched since the last step, no solid has come to contain
      // another.
      question_.outside = kept.step + error_ < apart;
      // After a long step the spheres' bound is better than the kept pairs'.
      if (!is_short(kept.step, mesh_a_, mesh_b_, pose.a_from_b.scale, apart))
        kept.nearest = KeptPairs::kNone;
    }
  }

  Separation find() {
    // Pairs kept from the last step give a better bound than spheres.
    if (question_.kept == nullptr || question_.kept->nearest == KeptPairs::kNone) {
      if (!lack_spheres(a_, b_))
        ask_spheres();
      else
        look_along_centres();
      if (overlap_) return answer({.overlap = true});
      if (question_.likely <= question_.enough) {
        Separation result;
        result.distance_max = pose_.unit_a * question_.likely;
        return result;
      }
    }
    Budget budget(settings_.max_visits != 0 ? settings_.max_visits - visits_
                                            : DescentLimits::kNoLimit);
    const MeshGap found = mesh_gap(question_, budget, scratch_.exact);
    visits_ += budget.visits();
    pairs_ += found.tests;
    if (question_.kept != nullptr && !found.overlap) question_.kept->apart = found.least;
    return answer(found);
  }

 private:
  /// Inner spheres that overlap prove an overlap; others bound the distance and give a direction.
  void ask_spheres() {
    const InnerSpheres spheres(a_, b_, pose_);
    overlap_ = spheres.share_the_middle();
    if (overlap_) return;
    // Meshes of a few blocks are measured in the time of some pairs of nodes.
    const std::uint32_t glance = mesh_a_.top == 1 && mesh_b_.top == 1 ? kGlance / 4 : kGlance;
    GapDescent descent(spheres.a, spheres.b, pose_,
                       std::min(glance, visit_limit(settings_.max_visits)), question_.most, false,
                       scratch_);
    descent.run();
    visits_ = descent.visits();
    pairs_ = descent.pairs();
    const SpherePair& nearest = descent.nearest();
    overlap_ = nearest.gap < -spheres.off;
    question_.likely = std::max(0.0, nearest.gap) + error_ + spheres.off;
    look_along(nearest.centre_b - nearest.centre_a);
  }
  /// The line of centres is a good direction if the solids are beside each other, not nested.
  void look_along_centres() {
    const Eigen::Vector3d between(pose_.a_from_b.t);
    if (between.norm() > std::max(mesh_a_.extent(), pose_.a_from_b.scale * mesh_b_.extent()))
      look_along(between);
  }
  void look_along(const Eigen::Vector3d& between) {
    if (const double length = between.norm(); length > 0)
      question_.toward = {between.x() / length, between.y() / length, between.z() / length};
  }

  Separation answer(const MeshGap& found) const {
    const double unit = pose_.unit_a;
    Separation result;
    if (found.farther) {
      result = farther_than(settings_.max_distance);
    } else if (found.overlap || found.distance == 0) {
      // Inner spheres lie in the solids themselves, meshes may be simplified.
      result.distance_max = overlap_ ? 0 : unit * simplified_;
    } else {
      const auto world = [&](const exact::Point& p) { return pose_.to_world({p.x, p.y, p.z}); };
      const exact::Point between = found.b - found.a;
      result.distance = unit * found.distance;
      result.distance_min = unit * std::max(0.0, found.least - error_);
      result.distance_max = unit * (found.distance * (1 + 1e-15) + error_);
      result.point_a = world(found.a);
      result.point_b = world(found.b);
      result.normal =
          pose_.rotation() * Eigen::Vector3d(between.x, between.y, between.z).normalized();
    }
    if (found.stopped) result.status = QueryStatus::budget_exhausted;
    result.node_visits = visits_;
    result.sphere_pairs = pairs_;
    return result;
  }

  const PlacedAsset& a_;
  const PlacedAsset& b_;
  const RelativePose& pose_;
  const SeparationSettings& settings_;
  Workspace::Impl& scratch_;
  const MeshTree mesh_a_, mesh_b_;
  const double simplified_, error_;  ///< A's unit frame: of the meshes, and with all rounding
  GapQuestion question_{mesh_a_, mesh_b_, pose_.a_from_b, pose_.b_from_a};
  bool overlap_ = false;  ///< of inner spheres
  std::uint32_t visits_ = 0, pairs_ = 0;
};

}  // namespace

bool spheres_share(const PlacedAsset& a, const PlacedAsset& b, const Penetration& found) noexcept {
  if (lack_spheres(a, b)) return false;
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose) return false;
  const InnerSpheres spheres(a, b, *pose);
  const Eigen::Vector3d middle =
      pose->rotation().transpose() * (found.centroid - vector(pose->origin_a)) / pose->unit_a;
  if (spheres.share(middle)) return true;
  // The middle may lie between the parts of an overlap, or between the small spheres near a
  // surface: points beside it are in spheres of both about as often again.
  constexpr double kAside = 0.4;
  const Eigen::Vector3d push = pose->rotation().transpose() * found.force;
  if (!(push.squaredNorm() > 0)) return false;
  const Eigen::Vector3d across =
      kAside * std::cbrt(found.volume) / pose->unit_a * push.unitOrthogonal();
  const Eigen::Vector3d other = push.normalized().cross(across);
  return spheres.share(middle + across) || spheres.share(middle - across) ||
         spheres.share(middle + other) || spheres.share(middle - other);
}

Separation find_separation(const PlacedAsset& a, const PlacedAsset& b,
                           const SeparationSettings& settings, Workspace& workspace,
                           double enough) noexcept {
  const bool surfaces = !settings.inner_spheres && keeps_mesh(a) && keeps_mesh(b);
  if (!surfaces && lack_spheres(a, b)) return missing_data<Separation>();
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<Separation>();
  Separation result;
  if (surfaces && pose->a_from_b.scale > kLargestGapScale) {
    result = find_separation(b, a, settings, workspace, enough);
    std::swap(result.point_a, result.point_b);
    result.normal = -result.normal;
    return result;
  }
  if (surfaces) return SurfaceGap(a, b, *pose, settings, enough, *workspace.impl()).find();
  const InnerSpheres spheres(a, b, *pose);
  const double length = span(spheres.a.root(), spheres.b.root(), pose->a_from_b);
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  if (settings.max_distance > 0 && settings.max_visits == 0) {
    const double limit = settings.max_distance / pose->unit_a +
                         distance_error(Precision::float32, length) + spheres.off;
    GapDescent near(spheres.a, spheres.b, *pose, DescentLimits::kNoLimit, limit, true,
                    *workspace.impl());
    near.run();
    if (near.cover() == limit) return farther_than(settings.max_distance);
  }
  GapDescent descent(spheres.a, spheres.b, *pose, visit_limit(settings.max_visits), kNoLimit, true,
                     *workspace.impl());
  descent.run();
  result.node_visits = descent.visits();
  result.sphere_pairs = descent.pairs();
  if (descent.stopped()) result.status = QueryStatus::budget_exhausted;
  if (descent.overlap()) return result;

  const double unit = pose->unit_a;
  const double kernel_error = distance_error(descent.precision(), length);
  const SpherePair& nearest = descent.nearest();
  result.distance_min = unit * std::max(0.0, descent.cover() - kernel_error - spheres.off);
  if (settings.max_distance > 0 && result.distance_min > settings.max_distance)
    return farther_than(settings.max_distance);
  result.distance = unit * nearest.gap;
  result.distance_max = unit * (nearest.gap + spheres.off);
  const Eigen::Vector3d axis = (nearest.centre_b - nearest.centre_a).normalized();
  result.point_a = pose->to_world(nearest.centre_a + nearest.radius_a * axis);
  result.point_b = pose->to_world(nearest.centre_b - nearest.radius_b * axis);
  result.normal = pose->rotation() * axis;
  return result;
}

}  // namespace ist
