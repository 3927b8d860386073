#pragma once

#include <ist/query.h>

#include <algorithm>
#include <type_traits>

#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/shape/shapes.h"
#include "query/tree_overlap/open_runs.h"

namespace ist {

/// Whether a shape and a tree overlap: best first, the ball that reaches deepest for its size. All
/// in the shape's frame.
template <class Sampler>
class ShapeMeetingSearch {
 public:
  ShapeMeetingSearch(Sampler& shape, const SphereTree& tree, const RelativePose& pose,
                     Workspace::Impl& scratch) noexcept
      : shape_(shape), tree_(tree), map_(pose.a_from_b), waiting_(scratch) {
    const double reach = map_.scale * std::max(tree_.header->root[3], tree_.header->root_cover) +
                         vector(map_.t).norm();
    error_ = shape_.error() + distance_error(Precision::float64, reach) + pose.rounding_of_world();
  }

  YesNo run() noexcept {
    if (gap(tree_.ball(tree_.top, 0).centre, tree_.header->root_cover) > error_) return YesNo::no;
    return waiting_.search({0, 0, tree_.top, 0}, covers_meet_,
                           [&](const NodePair& pair) { return open(pair); });
  }

 private:
  /// Grids beyond their border and functions tell no more than that the surface is not nearer.
  static constexpr bool kTrueDistances =
      !std::is_same_v<Sampler, GridSampler> && !std::is_same_v<Sampler, FunctionSampler>;

  /// How deep a point is in the shape, negative outside.
  double depth_at(const double (&centre)[3]) noexcept {
    double at[3];
    map_.apply(centre, at);
    return -shape_.nearest({at[0], at[1], at[2]}).distance;
  }
  double gap(const double (&centre)[3], double radius) noexcept {
    return -depth_at(centre) - radius * map_.scale;
  }

  /// True if something below is certain to be in the shape.
  bool open(const NodePair& pair) noexcept {
    const int level = pair.level_a;
    const std::uint32_t below = tree_.count(level - 1);
    waiting_.start(pair, true);
    for (std::uint32_t lane = 0; lane < kWidth && kWidth * pair.a + lane < below; ++lane) {
      const std::uint32_t child = kWidth * pair.a + lane;
      const NodeBall ball = level == 0 ? tree_.sphere(pair.a, lane) : tree_.ball(level - 1, child);
      const double cover = level == 0 ? static_cast<double>(tree_.sphere_cover[child])
                                      : tree_.cover(level - 1, child);
      const double depth = depth_at(ball.centre), radius = ball.r * map_.scale;
      // All of the ball is in the shape; or the centre of a sphere is, or a part of it.
      if (depth - radius > error_) return true;
      if (level == 0 && (depth > error_ || (kTrueDistances && depth + radius > error_)))
        return true;
      const bool meets = -depth - radius <= error_;
      const bool cover_meets = -depth - cover * map_.scale <= error_;
      if (level == 0) {
        covers_meet_ |= cover_meets;
      } else if (meets) {
        waiting_.add(lane, std::max(0.0, 1 - depth / radius), true);
      } else if (cover_meets && !covers_meet_) {
        waiting_.add(lane, -depth / radius, false);
      }
    }
    waiting_.finish();
    return false;
  }

  Sampler& shape_;
  const SphereTree& tree_;
  const Similarity& map_;
  double error_;  ///< of a gap, the shape's and by rounding
  OpenRuns waiting_;
  bool covers_meet_ = false;
};

}  // namespace ist
