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
#include "query/descent/workspace.h"
#include "query/exact/kept_mesh.h"
#include "query/exact/mesh_distance.h"
#include "query/kernel/gap_kernel.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

// Of a larger B the fourth powers of lengths would overflow: A is moved into its frame instead.
constexpr double kLargestScale = 1e30;

/// Depth-first branch and bound, nearest child first, for two minima at once: the gap of the inner
/// spheres and that of their cover balls. All in A's unit frame.
class GapDescent {
 public:
  GapDescent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
             const SeparationSettings& settings, Workspace::Impl& scratch)
      : a_(a),
        b_(b),
        a_side_(a, b, pose.a_from_b),
        b_side_(b, a, pose.b_from_a),
        scale_(pose.a_from_b.scale),
        precision_(precision_for_gap(a.root(), b.root(), pose.a_from_b)),
        stack_(scratch.waiting.get()),
        budget_(visit_limit(settings.max_visits)) {}

  void run() {
    measure(a_.sphere(0, 0), b_.sphere(0, 0));
    gap_ = exact_gap_;
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
  bool wanted(double gap, double cover) const {
    return gap < gap_ || (cover_ > 0 && cover < cover_);
  }

  void push(const WaitingPair& pair) { stack_[size_++] = pair; }

  void open_node(const WaitingPair& pair) {
    const bool open_a =
        pair.level_b == 0 || (pair.level_a > 0 && a_.ball(pair.level_a, pair.a).r >=
                                                      scale_ * b_.ball(pair.level_b, pair.b).r);
    const double factor = open_a ? 1 : scale_;
    const double cover_limit = cover_ > 0 ? cover_ : -std::numeric_limits<double>::infinity();
    ChildGaps gaps;
    if (open_a) {
      child_gaps(a_side_, pair.level_a, pair.a, pair.level_b, pair.b, gap_, cover_limit, precision_,
                 gaps);
    } else {
      child_gaps(b_side_, pair.level_b, pair.b, pair.level_a, pair.a, gap_ / scale_,
                 cover_limit / scale_, precision_, gaps);
    }
    const std::uint32_t below = open_a ? a_.level[pair.level_a - 1].count - kWidth * pair.a
                                       : b_.level[pair.level_b - 1].count - kWidth * pair.b;
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
      // The nearest on top, by insertion: sixteen at most.
      std::size_t place = size_++;
      for (; place > first && stack_[place - 1].gap < gap; --place)
        stack_[place] = stack_[place - 1];
      stack_[place] = child;
    }
  }

  void open_leaves(const WaitingPair& pair) {
    const LeafGap leaf = leaf_gap(a_side_, pair.a, pair.b, gap_, cover_, precision_);
    pairs_ += kWidth * kWidth;
    cover_ = std::min(cover_, leaf.cover);
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
  double gap_ = std::numeric_limits<double>::infinity();  ///< least so far, as the kernel has it
  double cover_ = std::numeric_limits<double>::infinity();
  double exact_gap_ = std::numeric_limits<double>::infinity();
  Eigen::Vector3d centre_a_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_b_ = Eigen::Vector3d::Zero();
  double radius_a_ = 0, radius_b_ = 0;
  std::uint32_t pairs_ = 0;
  bool overlap_ = false;
  bool stopped_ = false;
};

/// Between the surfaces that both assets keep.
Separation surface_separation(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                              const SeparationSettings& settings, ExactScratch& scratch) noexcept {
  const MeshTree mesh_a = mesh_of(a), mesh_b = mesh_of(b);
  Budget budget(visit_limit(settings.max_visits));
  const MeshGap found = mesh_gap(mesh_a, mesh_b, pose.a_from_b, pose.b_from_a, budget, scratch);
  Separation result;
  result.node_visits = budget.visits();
  result.sphere_pairs = found.tests;
  if (found.stopped) result.status = QueryStatus::budget_exhausted;
  const double unit = pose.unit_a;
  const double simplified = mesh_a.header->error + pose.a_from_b.scale * mesh_b.header->error;
  if (found.overlap || found.distance == 0) {
    result.distance_max = unit * simplified;
    return result;
  }
  const double error = simplified + mesh_a.header->rounding +
                       pose.a_from_b.scale * mesh_b.header->rounding +
                       moved_by_poses(a, b, mesh_b, pose) + pose.rounding_of_world();
  const auto world = [&](const exact::Point& p) { return pose.to_world({p.x, p.y, p.z}); };
  const exact::Point between = found.b - found.a;
  result.distance = unit * found.distance;
  result.distance_min = unit * std::max(0.0, found.least - error);
  result.distance_max = unit * (found.distance * (1 + 1e-15) + error);
  result.point_a = world(found.a);
  result.point_b = world(found.b);
  result.normal = pose.rotation() * Eigen::Vector3d(between.x, between.y, between.z).normalized();
  return result;
}

}  // namespace

Separation find_separation(const PlacedTree& a, const PlacedTree& b,
                           const SeparationSettings& settings, Workspace& workspace) noexcept {
  const bool surfaces = !settings.inner_spheres && keeps_mesh(a) && keeps_mesh(b);
  if (!surfaces && lack_spheres(a, b)) return not_held<Separation>();
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<Separation>();
  Separation result;
  if (surfaces && pose->a_from_b.scale > kLargestScale) {
    result = separation(b, a, settings, workspace);
    std::swap(result.point_a, result.point_b);
    result.normal = -result.normal;
    return result;
  }
  if (surfaces) return surface_separation(a, b, *pose, settings, workspace.impl()->exact);
  const SphereTree tree_a = sphere_tree(a.tree, Measure::inner);
  const SphereTree tree_b = sphere_tree(b.tree, Measure::inner);
  GapDescent descent(tree_a, tree_b, *pose, settings, *workspace.impl());
  descent.run();
  result.node_visits = descent.visits();
  result.sphere_pairs = descent.pairs();
  if (descent.stopped()) result.status = QueryStatus::budget_exhausted;
  if (descent.overlap()) return result;

  const double unit = pose->unit_a;
  const double length = span(tree_a.root(), tree_b.root(), pose->a_from_b);
  const double kernel_error = distance_error(descent.precision(), length);
  const double world_error = distance_error(Precision::float64, length) + pose->rounding_of_world();
  const double gap = descent.gap();
  result.distance = unit * gap;
  result.distance_min = unit * std::max(0.0, descent.cover() - kernel_error - world_error);
  result.distance_max = unit * (gap + world_error);
  const Eigen::Vector3d axis = (descent.centre_b() - descent.centre_a()).normalized();
  result.point_a = pose->to_world(descent.centre_a() + descent.radius_a() * axis);
  result.point_b = pose->to_world(descent.centre_b() - descent.radius_b() * axis);
  result.normal = pose->rotation() * axis;
  return result;
}

}  // namespace ist
