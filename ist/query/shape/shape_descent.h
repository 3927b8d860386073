#pragma once

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/scratch/workspace.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/probe_sum.h"
#include "query/tree_overlap/answer.h"

namespace ist {

/// The sums of a traversal of a tree against a surface: summed balls, nodes wholly inside, and
/// unopened nodes, of which half counts. `bins`: get the same.
class ProbeTally {
 public:
  ProbeTally(const SphereTree& probes, const RelativePose& pose, ContactBins* bins) noexcept
      : probes_(probes), pose_(pose), map_(pose.a_from_b), bins_(bins) {}

  /// Adds the summed balls of a leaf block.
  void add(std::uint32_t block, const ProbeTotal& part) noexcept {
    total_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, 0, block, part.overlap);
  }

  /// Counts pairs of balls and triangles, or balls that a shape was sampled for.
  void count(std::uint32_t pairs) noexcept { pairs_ += pairs; }

  /// Adds nodes that lie inside.
  void add_contained(int level, const std::uint32_t* nodes, std::size_t n) noexcept {
    add_subtrees(probes_, level, nodes, n, contained_);
    if (bins_ == nullptr) return;
    for (std::size_t i = 0; i < n; ++i) {
      SubtreeSums sums;
      add_subtrees(probes_, level, nodes + i, 1, sums);
      bins_->add_guess(0, 0, level, nodes[i], whole_spheres(sums, map_));
    }
  }

  /// Adds half of a node that was not opened.
  void add_unopened(int level, std::uint32_t block) noexcept {
    const NodeBall ball = probes_.ball(level, block);
    Overlap part;
    part.volume =
        0.5 * (probes_.sums(level, block).volume * (map_.scale * map_.scale * map_.scale));
    part.moment = part.volume * (mapped(map_, ball.centre) - vector(map_.t));
    left_ += 2 * part.volume;
    guess_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, level, block, part);
    stopped_ = true;
  }

  /// The answer in world units. `off`: bound on the error of the surface, its unit frame.
  Penetration answer(double off, std::uint32_t visits) const noexcept {
    Overlap sum = total_.overlap;
    sum.add(whole_spheres(contained_, map_));
    sum.error = 2 * off * total_.area + 1e-13 * (total_.crossed + sum.volume);
    const double scale = map_.scale;
    const double most = probes_.header->volume_sum * (scale * scale * scale) * (1 + 1e-9);
    const double lowest = std::max(0.0, sum.volume - sum.error);
    const double highest =
        std::max(lowest, std::min(most, sum.volume + sum.error + (1 + 1e-9) * left_));
    add_guess(sum);
    Penetration result = world_answer(sum, lowest, highest, pose_);
    result.node_visits = visits;
    result.sphere_pairs = pairs_ + contained_.spheres;
    if (stopped_) result.status = QueryStatus::budget_exhausted;
    return result;
  }

 private:
  /// Adds half of the unopened nodes. The force is assumed to grow with the volume.
  void add_guess(Overlap& sum) const noexcept {
    if (!(left_ > 0)) return;
    if (sum.volume > 0) {
      const double factor = 1 + guess_.volume / sum.volume;
      sum.force *= factor;
      sum.torque *= factor;
    }
    sum.add(guess_);
  }

  const SphereTree& probes_;
  const RelativePose& pose_;
  const Similarity& map_;
  ContactBins* const bins_;
  ProbeTotal total_;
  SubtreeSums contained_;
  double left_ = 0;  ///< volume of unopened nodes
  Overlap guess_;    ///< half of it
  std::uint32_t pairs_ = 0;
  bool stopped_ = false;
};

/// The overlap of the spheres of a tree with a shape that can be sampled. Level by level: a node
/// whose ball the surface does not reach is wholly inside or outside.
template <class Sampler>
class ShapeDescent {
 public:
  /// All arguments must outlive the traversal. A is the shape.
  ShapeDescent(Sampler& shape, const SphereTree& probes, const RelativePose& pose,
               const DescentLimits& limits, Workspace::Impl& scratch,
               ContactBins* bins = nullptr) noexcept
      : shape_(shape),
        probes_(probes),
        map_(pose.a_from_b),
        scratch_(scratch),
        budget_(limits.max_visits),
        tally_(probes, pose, bins) {}

  void run() noexcept {
    PairList& now = scratch_.now;
    now.a[0] = 0;
    now.size = 1;
    int level = probes_.top;
    for (; level > 0 && now.size > 0; --level) {
      if (!open(level)) return;
      std::swap(scratch_.now, scratch_.next);
    }
    for (std::size_t i = 0; i < now.size; ++i) {
      if (budget_.grant(1) == 0) return add_unopened(0, i);
      sum_block(now.a[i]);
    }
  }

  Penetration penetration() const noexcept {
    const double reach = map_.scale * probes_.header->root[3] + vector(map_.t).norm();
    return tally_.answer(shape_.error() + 1e-15 * reach, budget_.visits());
  }

 private:
  /// Opens the nodes of the current list; false if a limit stopped it, with the rest in the tally.
  bool open(int level) noexcept {
    const PairList& now = scratch_.now;
    PairList& next = scratch_.next;
    next.size = 0;
    std::uint32_t contained[kWidth];
    for (std::size_t i = 0; i < now.size; ++i) {
      const std::uint32_t block = now.a[i];
      if (budget_.grant(1) == 0 || next.size + kWidth > scratch_.capacity) {
        add_unopened(level, i);
        for (std::size_t k = 0; k < next.size; ++k) tally_.add_unopened(level - 1, next.a[k]);
        return false;
      }
      ProbeBalls balls;
      place_probes(probes_, level, block, map_, balls);
      const std::uint32_t used = std::min(kWidth, probes_.count(level - 1) - kWidth * block);
      std::size_t count = 0;
      for (std::uint32_t lane = 0; lane < used; ++lane) {
        const double d = shape_.sample(balls.centre(lane)).distance;
        const double reach = sure_reach(balls.r[lane], shape_.error());
        const std::uint32_t child = kWidth * block + lane;
        if (d >= reach) continue;
        if (d <= -reach) {
          contained[count++] = child;
        } else {
          next.a[next.size++] = child;
        }
      }
      tally_.add_contained(level - 1, contained, count);
    }
    return true;
  }

  void sum_block(std::uint32_t block) noexcept {
    ProbeBalls balls;
    place_probes(probes_, 0, block, map_, balls);
    const std::uint32_t lanes = std::min(kWidth, probes_.header->sphere_count - kWidth * block);
    ProbeTotal part;
    std::uint32_t pairs = 0;
    if constexpr (requires { shape_.block(balls, lanes, map_.t, pairs); }) {
      part = shape_.block(balls, (1u << lanes) - 1, map_.t, pairs);
    } else {
      for (std::size_t i = 0; i < lanes; ++i) {
        const Eigen::Vector3d at = balls.centre(i);
        const BallPart ball = shape_.part(at, balls.r[i]);
        if (!(ball.volume > 0)) continue;
        ++pairs;
        add_part(at - vector(map_.t), ball.volume, Eigen::Vector3d(ball.gradient),
                 Eigen::Vector3d(ball.moment), part.overlap);
        part.area += ball.area;
        if (ball.area > 0) part.crossed += ball_volume(balls.r[i]);
      }
    }
    tally_.add(block, part);
    tally_.count(pairs);
  }

  void add_unopened(int level, std::size_t from) noexcept {
    const PairList& now = scratch_.now;
    for (std::size_t i = from; i < now.size; ++i) tally_.add_unopened(level, now.a[i]);
  }

  Sampler& shape_;
  const SphereTree& probes_;
  const Similarity& map_;
  Workspace::Impl& scratch_;
  Budget budget_;
  ProbeTally tally_;
};

}  // namespace ist
