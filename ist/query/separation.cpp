#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include <ist/query.h>

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

/// Depth-first branch and bound, nearest child first, for two minima at once: the gap of the inner
/// spheres and, if asked, that of their cover balls; what is beyond the limit is not looked at. All
/// in A's unit frame.
class GapDescent {
 public:
  GapDescent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
             std::uint32_t most_visits, double limit, bool covers, Workspace::Impl& scratch)
      : a_(a),
        b_(b),
        a_side_(a, b, pose.a_from_b),
        b_side_(b, a, pose.b_from_a),
        scale_(pose.a_from_b.scale),
        precision_(precision_for_gap(a.root(), b.root(), pose.a_from_b)),
        stack_(scratch.waiting.get()),
        budget_(most_visits),
        gap_(limit),
        cover_(covers ? limit : 0) {}

  void run() {
    measure(a_.sphere(0, 0), b_.sphere(0, 0));
    if (root_gap() > gap_) return;
    gap_ = std::min(gap_, exact_gap_);
    push({0, 0, 0, 0, a_.top, b_.top});
    while (size_ > 0 && !overlap_) {
      const WaitingPair pair = stack_[size_ - 1];
      if (!wanted(pair.gap, pair.cover)) {
        --size_;
        continue;
      }
      if (budget_.grant(1) == 0) break;
      --size_;
      if (pair.level_a == 0 && pair.level_b == 0) {
        open_leaves(pair);
      } else {
        open_node(pair);
      }
    }
    // What still waits has gaps of at least these.
    stopped_ = size_ > 0 && !overlap_;
    for (std::size_t i = 0; stopped_ && i < size_; ++i) cover_ = std::min(cover_, stack_[i].cover);
  }

  bool overlap() const { return overlap_; }
  bool stopped() const { return stopped_; }
  double gap() const { return exact_gap_; }
  double cover() const { return cover_; }
  Precision precision() const { return precision_; }
  std::uint32_t visits() const { return budget_.visits(); }
  std::uint32_t pairs() const { return pairs_; }
  const Eigen::Vector3d& centre_a() const { return centre_a_; }
  const Eigen::Vector3d& centre_b() const { return centre_b_; }
  double radius_a() const { return radius_a_; }
  double radius_b() const { return radius_b_; }

 private:
  /// Of all that counts; in double.
  double root_gap() const {
    const auto root_a = a_.root(), root_b = b_.root();
    double moved[3];
    a_side_.x_from_y->apply(root_b.centre, moved);
    const double between = (vector(moved) - vector(root_a.centre)).norm();
    return between -
           (cover_ > 0 ? root_a.reach() + scale_ * root_b.reach() : root_a.r + scale_ * root_b.r);
  }

  bool wanted(double gap, double cover) const {
    return gap < gap_ || (cover_ > 0 && cover < cover_);
  }

  double cover_limit() const {
    return cover_ > 0 ? cover_ : -std::numeric_limits<double>::infinity();
  }

  void push(const WaitingPair& pair) { stack_[size_++] = pair; }

  void open_node(const WaitingPair& pair) {
    const bool open_a =
        pair.level_b == 0 || (pair.level_a > 0 && a_.ball(pair.level_a, pair.a).r >=
                                                      scale_ * b_.ball(pair.level_b, pair.b).r);
    const double factor = open_a ? 1 : scale_;
    ChildGaps gaps;
    if (open_a) {
      child_gaps(a_side_, pair.level_a, pair.a, pair.level_b, pair.b, gap_, cover_limit(),
                 precision_, gaps);
    } else {
      child_gaps(b_side_, pair.level_b, pair.b, pair.level_a, pair.a, gap_ / scale_,
                 cover_limit() / scale_, precision_, gaps);
    }
    const std::uint32_t below = open_a ? a_.level[pair.level_a - 1].count - kWidth * pair.a
                                       : b_.level[pair.level_b - 1].count - kWidth * pair.b;
    const BallBlock& opened =
        open_a ? a_.level[pair.level_a].blocks[pair.a] : b_.level[pair.level_b].blocks[pair.b];
    const double still = open_a ? scale_ * b_.ball(pair.level_b, pair.b).r
                                : a_.ball(pair.level_a, pair.a).r / scale_;
    const std::size_t first = size_;
    // Unused lanes are left out by number: among objects far enough apart no radius would do it.
    const std::uint32_t used = (1u << std::min(kWidth, below)) - 1;
    for (std::uint32_t left = gaps.near & used; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
      const double gap = factor * gaps.gap[lane];
      const double cover = factor * gaps.cover[lane];
      if (!wanted(gap, cover)) continue;
      WaitingPair child = pair;
      child.gap = gap;
      child.cover = cover;
      if (open_a) {
        child.a = kWidth * pair.a + lane;
        --child.level_a;
      } else {
        child.b = kWidth * pair.b + lane;
        --child.level_b;
      }
      // The nearest on top, by insertion: sixteen at most. Of balls that meet the one that shares
      // most for its size is most likely to hold spheres that do.
      const double sizes = factor * (double{opened.r[lane]} + still);
      child.order = gap < 0 ? gap / sizes : gap;
      std::size_t place = size_++;
      for (; place > first && stack_[place - 1].order < child.order; --place)
        stack_[place] = stack_[place - 1];
      stack_[place] = child;
    }
  }

  void open_leaves(const WaitingPair& pair) {
    const LeafGap leaf = leaf_gap(a_side_, pair.a, pair.b, gap_, cover_limit(), precision_);
    pairs_ += kWidth * kWidth;
    if (cover_ > 0) cover_ = std::min(cover_, leaf.cover);
    if (leaf.gap >= gap_) return;
    gap_ = leaf.gap;
    measure(a_.sphere(pair.a, leaf.lane_x), b_.sphere(pair.b, leaf.lane_y));
  }

  /// A pair of inner spheres in double: its gap bounds the distance from above, whichever it is.
  void measure(const NodeBall& sphere_a, const NodeBall& sphere_b) {
    double moved[3];
    a_side_.x_from_y->apply(sphere_b.centre, moved);
    const Eigen::Vector3d xa(sphere_a.centre[0], sphere_a.centre[1], sphere_a.centre[2]);
    const Eigen::Vector3d xb(moved[0], moved[1], moved[2]);
    const double gap = ((xb - xa).norm() - sphere_a.r) - scale_ * sphere_b.r;
    if (gap >= exact_gap_) return;
    exact_gap_ = gap;
    centre_a_ = xa;
    centre_b_ = xb;
    radius_a_ = sphere_a.r;
    radius_b_ = scale_ * sphere_b.r;
    overlap_ = gap <= 0;
  }

  const SphereTree& a_;
  const SphereTree& b_;
  const GapSide a_side_, b_side_;
  const double scale_;
  const Precision precision_;
  WaitingPair* const stack_;
  std::size_t size_ = 0;
  Budget budget_;
  double gap_;    ///< least so far, as the kernel has it, or the limit
  double cover_;  ///< 0: not asked, or met
  double exact_gap_ = std::numeric_limits<double>::infinity();
  Eigen::Vector3d centre_a_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_b_ = Eigen::Vector3d::Zero();
  double radius_a_ = 0, radius_b_ = 0;
  std::uint32_t pairs_ = 0;
  bool overlap_ = false;
  bool stopped_ = false;
};

/// Whether a point lies at least `margin` deep in a sphere of a tree; both in its unit frame. Looks
/// at some nodes alone, the one around the point most deeply first, so that it may miss some.
bool is_seen_within(const SphereTree& tree, const Eigen::Vector3d& point, double margin) {
  constexpr int kMostVisits = 16;
  struct Waiting {
    int level;
    std::uint32_t block;
    float depth;
  };
  Waiting stack[kWidth * (kMaxLevels + 1)];  // to fill it would take as long as all else
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
    for (std::uint32_t left = balls_around(balls, at, inside) & used; left != 0; left &= left - 1) {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(left));
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

/// Of two solids, and points that both may hold.
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
  const double off;  ///< what rounding may move a point by; A's unit frame

  /// Whether spheres of both are seen to hold a point of A's unit frame: then the solids overlap.
  bool share(const Eigen::Vector3d& point) const {
    if (!is_seen_within(a, point, off)) return false;
    double in_b[3];
    pose_.b_from_a.apply({point.x(), point.y(), point.z()}, in_b);
    return is_seen_within(b, vector(in_b), off / pose_.a_from_b.scale);
  }

  /// Whether the middle of what the balls around them share is seen to be in both: of solids that
  /// fill these balls it mostly is.
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
    double moved[3];
    pose_.a_from_b.apply(root_b.centre, moved);
    const Eigen::Vector3d centre = vector(root_a.centre), between = vector(moved) - centre;
    const double length = between.norm(), r = pose_.a_from_b.scale * root_b.r;
    if (!(length > 0)) return centre;
    const double low = std::max(length - r, -root_a.r), high = std::min(root_a.r, length + r);
    return centre + (low + high) / (2 * length) * between;
  }

  const RelativePose& pose_;
};

/// Between the surfaces that both assets keep.
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
      // Surfaces that have not come together on the way hold what they held.
      question_.outside = kept.step + error_ < apart;
      // A long step: what was near says less than the spheres do.
      if (!is_short(kept.step, mesh_a_, mesh_b_, pose.a_from_b.scale, apart))
        kept.nearest = KeptPairs::kNone;
    }
  }

  Separation find() {
    // What the last step found says more than spheres do.
    if (question_.kept == nullptr || question_.kept->nearest == KeptPairs::kNone) {
      if (!lack_spheres(a_, b_)) ask_spheres();
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
  /// Inner spheres that meet prove an overlap; else they bound the distance, and show the way.
  void ask_spheres() {
    const InnerSpheres spheres(a_, b_, pose_);
    overlap_ = spheres.share_the_middle();
    if (overlap_) return;
    GapDescent descent(spheres.a, spheres.b, pose_,
                       std::min(kGlance, visit_limit(settings_.max_visits)), question_.most, false,
                       scratch_);
    descent.run();
    visits_ = descent.visits();
    pairs_ = descent.pairs();
    overlap_ = descent.gap() < -spheres.off;
    question_.likely = std::max(0.0, descent.gap()) + error_ + spheres.off;
    const Eigen::Vector3d way = descent.centre_b() - descent.centre_a();
    if (const double length = way.norm(); length > 0)
      question_.toward = {way.x() / length, way.y() / length, way.z() / length};
  }

  Separation answer(const MeshGap& found) const {
    const double unit = pose_.unit_a;
    Separation result;
    if (found.farther) {
      result = farther_than(settings_.max_distance);
    } else if (found.overlap || found.distance == 0) {
      // Spheres are the solids' own.
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
  const double simplified_, error_;  ///< A's unit frame; of the meshes, and with all roundings
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
  // The middle of an overlap in parts may lie beside them, and between spheres that are small near
  // the surface: points on its sides are in spheres of both about as often again.
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
  const SphereTree tree_a = sphere_tree(a.asset, Measure::inner);
  const SphereTree tree_b = sphere_tree(b.asset, Measure::inner);
  const double length = span(tree_a.root(), tree_b.root(), pose->a_from_b);
  const double world_error = distance_error(Precision::float64, length) + pose->rounding_of_world();
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  if (settings.max_distance > 0 && settings.max_visits == 0) {
    const double limit = settings.max_distance / pose->unit_a +
                         distance_error(Precision::float32, length) + world_error;
    GapDescent near(tree_a, tree_b, *pose, DescentLimits::kNoLimit, limit, true, *workspace.impl());
    near.run();
    if (near.cover() == limit) return farther_than(settings.max_distance);
  }
  GapDescent descent(tree_a, tree_b, *pose, visit_limit(settings.max_visits), kNoLimit, true,
                     *workspace.impl());
  descent.run();
  result.node_visits = descent.visits();
  result.sphere_pairs = descent.pairs();
  if (descent.stopped()) result.status = QueryStatus::budget_exhausted;
  if (descent.overlap()) return result;

  const double unit = pose->unit_a;
  const double kernel_error = distance_error(descent.precision(), length);
  const double gap = descent.gap();
  result.distance_min = unit * std::max(0.0, descent.cover() - kernel_error - world_error);
  if (settings.max_distance > 0 && result.distance_min > settings.max_distance)
    return farther_than(settings.max_distance);
  result.distance = unit * gap;
  result.distance_max = unit * (gap + world_error);
  const Eigen::Vector3d axis = (descent.centre_b() - descent.centre_a()).normalized();
  result.point_a = pose->to_world(descent.centre_a() + descent.radius_a() * axis);
  result.point_b = pose->to_world(descent.centre_b() - descent.radius_b() * axis);
  result.normal = pose->rotation() * axis;
  return result;
}

}  // namespace ist
