#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/bits.h"
#include "query/asset/sphere_tree.h"
#include "query/base/no_answer.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/kernel/gap_kernel.h"
#include "query/solid_queries.h"
#include "query/tree_overlap/open_runs.h"

namespace ist {
namespace {

/// Best-first search: opens the nodes whose balls overlap most for their size. A's unit frame.
class OverlapSearch {
 public:
  OverlapSearch(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
                Workspace::Impl& scratch)
      : a_(a),
        b_(b),
        a_side_(a, b, pose.a_from_b, precision_for_gap(a.root(), b.root(), pose.a_from_b)),
        b_side_(b, a, pose.b_from_a, a_side_.precision),
        scale_(pose.a_from_b.scale),
        waiting_(scratch) {
    const double length = span(a.root(), b.root(), pose.a_from_b);
    error_ = distance_error(a_side_.precision, length) +
             distance_error(Precision::float64, length) + pose.rounding_of_world();
  }

  YesNo run() {
    if (root_cover_gap() > error_) return YesNo::no;
    return waiting_.search({0, 0, a_.top, b_.top}, covers_touch_, [&](const NodePair& pair) {
      if (pair.level_a > 0 || pair.level_b > 0) {
        open(pair);
        return false;
      }
      const LeafGap leaf = leaf_gap(a_side_, pair.a, pair.b, error_, cover_limit());
      covers_touch_ |= leaf.cover <= error_;
      return leaf.gap < -error_;
    });
  }

 private:
  /// Covers are tested until some overlap: from then on the answer is not `no`.
  double cover_limit() const {
    return covers_touch_ ? -std::numeric_limits<double>::infinity() : error_;
  }

  double root_cover_gap() const {
    const NodeBall ball = b_.ball(b_.top, 0);
    double moved[3];
    a_side_.x_from_y->apply(ball.centre, moved);
    double squares = 0;
    for (int k = 0; k < 3; ++k) {
      const double d = moved[k] - a_.header->root[k];
      squares += d * d;
    }
    return std::sqrt(squares) - a_.header->root_cover - scale_ * b_.header->root_cover;
  }

  void open(const NodePair& pair) {
    const double radius_a = a_.ball(pair.level_a, pair.a).r;
    const double radius_b = scale_ * b_.ball(pair.level_b, pair.b).r;
    const bool open_a = pair.level_b == 0 || (pair.level_a > 0 && radius_a >= radius_b);
    // In the unit frame of the side that is opened.
    const GapSide& side = open_a ? a_side_ : b_side_;
    const TreeNode node_a{pair.level_a, pair.a}, node_b{pair.level_b, pair.b};
    const TreeNode opened = open_a ? node_a : node_b;
    const double unit = open_a ? 1 : scale_;
    const double other_radius = (open_a ? radius_b : radius_a) / unit;
    ChildGaps gaps;
    child_gaps(side, opened, open_a ? node_b : node_a, error_ / unit, cover_limit() / unit, gaps);
    const std::uint32_t below = side.x->count(opened.level - 1) - kWidth * opened.block;
    const std::uint32_t used = (1u << std::min(kWidth, below)) - 1;
    const float* radii = side.x->level[opened.level].blocks[opened.block].r;
    waiting_.start(pair, open_a);
    for (const std::uint32_t lane : set_bits(gaps.near & used)) {
      if (unit * gaps.gap[lane] <= error_) {
        // Distance over the sum of radii.
        waiting_.add(lane, 1 + gaps.gap[lane] / (radii[lane] + other_radius), true);
      } else if (!covers_touch_ && unit * gaps.cover[lane] <= error_) {
        waiting_.add(lane, unit * gaps.cover[lane], false);
      }
    }
    waiting_.finish();
  }

  const SphereTree& a_;
  const SphereTree& b_;
  const GapSide a_side_, b_side_;
  const double scale_;
  double error_;  ///< rounding of a gap
  OpenRuns waiting_;
  bool covers_touch_ = false;
};

}  // namespace

YesNoAnswer find_overlap(const PlacedAsset& a, const PlacedAsset& b,
                         Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return {YesNo::unknown, QueryStatus::missing_data};
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return {YesNo::unknown, QueryStatus::invalid_input};
  const SphereTree tree_a = sphere_tree(a.asset, Measure::inner);
  const SphereTree tree_b = sphere_tree(b.asset, Measure::inner);
  return {OverlapSearch(tree_a, tree_b, *pose, *workspace.impl()).run(), QueryStatus::ok};
}

}  // namespace ist
