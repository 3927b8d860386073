#pragma once

#include <algorithm>
#include <limits>

#include <ist/shapes.h>

#include "query/base/budget.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/scratch/workspace.h"
#include "query/shape/shapes.h"

namespace ist {

/// The gaps between a shape and a tree's inner spheres and cover balls, in the shape's frame.
template <class Sampler>
class GapSearch : GapStack {
 public:
  GapSearch(Sampler& shape, const SphereTree& tree, const RelativePose& pose,
            const SeparationSettings& settings, Workspace::Impl& scratch) noexcept
      : GapStack(scratch, visit_limit(settings.max_visits), kInfinity, kInfinity),
        shape_(shape),
        tree_(tree),
        pose_(pose),
        map_(pose.a_from_b) {}

  Separation run() noexcept {
    const bool stopped = search(
        {-kInfinity, -kInfinity, 0, 0, tree_.top, 0}, [&](const WaitingPair& pair) { open(pair); },
        [&] { return gap_ <= 0; });
    return answer(stopped);
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  [[gnu::noinline]] void open(const WaitingPair& pair) noexcept {
    const int level = pair.level_a;
    const std::uint32_t below = tree_.count(level - 1);
    for (std::uint32_t lane = 0; lane < kWidth && kWidth * pair.a + lane < below; ++lane) {
      const std::uint32_t child = kWidth * pair.a + lane;
      const NodeBall ball = tree_.ball(level - 1, child);
      const double cover_radius = level == 0 ? static_cast<double>(tree_.sphere_cover[child])
                                             : tree_.cover(level - 1, child);
      const Eigen::Vector3d x = mapped(map_, ball.centre);
      const double distance = shape_.nearest(x).distance;
      const double gap = distance - ball.r * map_.scale;
      const double cover = distance - cover_radius * map_.scale;
      if (!wanted(gap, cover)) continue;
      if (level == 0) {
        ++pairs_;
        cover_ = std::min(cover_, cover);
        if (gap >= gap_) continue;
        gap_ = gap;
        centre_ = x;
        radius_ = ball.r * map_.scale;
        continue;
      }
      add({gap, cover, child, 0, level - 1, 0, gap});
    }
  }

  Separation answer(bool stopped) noexcept {
    Separation result;
    result.node_visits = budget_.visits();
    result.sphere_pairs = pairs_;
    if (stopped) result.status = QueryStatus::budget_exhausted;
    if (gap_ <= 0) return result;
    const double unit = pose_.unit_a;
    const double reach = map_.scale * std::max(tree_.header->root[3], tree_.header->root_cover) +
                         vector(map_.t).norm();
    const double off =
        shape_.error() + distance_error(Precision::float64, reach) + pose_.rounding_of_world();
    result.distance_min = unit * std::max(0.0, cover_ - off);
    if (!(gap_ < kInfinity)) {  // stopped before any sphere
      result.distance = result.distance_max = kInfinity;
      return result;
    }
    result.distance = unit * gap_;
    result.distance_max = unit * (gap_ + off);
    const Eigen::Vector3d outward = shape_.nearest(centre_).gradient;
    const double length = outward.norm();
    const Eigen::Vector3d out =
        length > 0 ? Eigen::Vector3d(outward / length) : Eigen::Vector3d::Zero().eval();
    result.point_b = pose_.to_world(centre_ - radius_ * out);
    result.point_a = pose_.to_world(centre_ - (radius_ + gap_) * out);
    result.normal = pose_.rotation() * out;
    return result;
  }

  Sampler& shape_;
  const SphereTree& tree_;
  const RelativePose& pose_;
  const Similarity& map_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double radius_ = 0;
  std::uint32_t pairs_ = 0;
};

}  // namespace ist
