#pragma once

#include <ist/query.h>

#include <algorithm>
#include <type_traits>

#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/shape/shapes.h"
#include "query/tree_overlap/open_runs.h"

namespace ist {

/// Best-first search for an overlap: opens the ball deepest for its size. All in the shape's frame.
template <class Sampler>
class ShapeOverlapSearch {
 public:
  ShapeOverlapSearch(Sampler& shape, const SphereTree& tree, const RelativePose& pose,
                     Workspace::Impl& scratch) noexcept
      : shape_(shape), tree_(tree), map_(pose.a_from_b), waiting_(scratch) {
    const double reach = map_.scale * std::max(tree_.header->root[3], tree_.header->root_cover) +
                         vector(map_.t).norm();
    error_ = shape_.error() + distance_error(Precision::float64, reach) + pose.rounding_of_world();
  }

  YesNo run() noexcept {
    if (gap(tree_.ball(tree_.top, 0).centre, tree_.header->root_cover) > error_) return YesNo::no;
    return waiting_.search({0, 0, tree_.top, 0}, covers_touch_,
                           [&](const NodePair& pair) { return open(pair); });
  }

 private:
  /// Grids beyond their border, and functions, give only a lower bound on the distance.
  static constexpr bool kTrueDistances =
      !std::is_same_v<Sampler, GridSampler> && !std::is_same_v<Sampler, FunctionSampler>;

  /// The depth of a point in the shape, negative outside.
  double depth_at(const double (&centre)[3]) noexcept {
    return -shape_.nearest(mapped(map_, centre)).distance;
  }
  double gap(const double (&centre)[3], double radius) noexcept {
    return -depth_at(centre) - radius * map_.scale;
  }

  /// Adds children; true if a sphere below certainly overlaps the shape.
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
      // The whole ball is in the shape, or a sphere's centre or a part of it is.
      if (depth - radius > error_) return true;
      if (level == 0 && (depth > error_ || (kTrueDistances && depth + radius > error_)))
        return true;
      const bool touches = -depth - radius <= error_;
      const bool cover_touches = -depth - cover * map_.scale <= error_;
      if (level == 0) {
        covers_touch_ |= cover_touches;
      } else if (touches) {
        waiting_.add(lane, std::max(0.0, 1 - depth / radius), true);
      } else if (cover_touches && !covers_touch_) {
        waiting_.add(lane, -depth / radius, false);
      }
    }
    waiting_.finish();
    return false;
  }

  Sampler& shape_;
  const SphereTree& tree_;
  const Similarity& map_;
  double error_;  ///< of a gap: the shape's, and rounding
  OpenRuns waiting_;
  bool covers_touch_ = false;
};

}  // namespace ist
