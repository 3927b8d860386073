#pragma once

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/scratch/workspace.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/probe_tally.h"

namespace ist {

/// The volume that the spheres of a tree have inside a shape that tells how far its surface is.
/// Level by level; a node whose ball the surface does not reach is in or out as a whole.
template <class Sampler>
class ShapeDescent {
 public:
  /// `pose`: of the shape, in its own frame, and of the tree. All arguments must outlive the
  /// descent.
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
      if (budget_.grant(1) == 0) return leave(0, i);
      sum_block(now.a[i]);
    }
  }

  Penetration penetration() const noexcept {
    const double reach = map_.scale * probes_.header->root[3] + vector(map_.t).norm();
    return tally_.answer(shape_.error() + 1e-15 * reach, budget_.visits());
  }

 private:
  /// Opens the nodes of the current list; false if the budget ends, what is left being left then.
  bool open(int level) noexcept {
    const PairList& now = scratch_.now;
    PairList& next = scratch_.next;
    next.size = 0;
    std::uint32_t held[kWidth];
    for (std::size_t i = 0; i < now.size; ++i) {
      const std::uint32_t block = now.a[i];
      if (budget_.grant(1) == 0 || next.size + kWidth > scratch_.capacity) {
        leave(level, i);
        for (std::size_t k = 0; k < next.size; ++k) tally_.leave(level - 1, next.a[k]);
        return false;
      }
      ProbeBalls balls;
      place_probes(probes_, level, block, map_, balls);
      const std::uint32_t used = std::min(kWidth, probes_.count(level - 1) - kWidth * block);
      std::size_t count = 0;
      for (std::uint32_t lane = 0; lane < used; ++lane) {
        const Eigen::Vector3d x(balls.origin[0] + balls.x[lane], balls.origin[1] + balls.y[lane],
                                balls.origin[2] + balls.z[lane]);
        const double d = shape_.sample(x).distance;
        const double reach = sure_reach(balls.r[lane], shape_.error());
        const std::uint32_t child = kWidth * block + lane;
        if (d >= reach) continue;
        if (d <= -reach) {
          held[count++] = child;
        } else {
          next.a[next.size++] = child;
        }
      }
      tally_.hold(level - 1, held, count);
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
        const Eigen::Vector3d at(balls.origin[0] + balls.x[i], balls.origin[1] + balls.y[i],
                                 balls.origin[2] + balls.z[i]);
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

  void leave(int level, std::size_t from) noexcept {
    const PairList& now = scratch_.now;
    for (std::size_t i = from; i < now.size; ++i) tally_.leave(level, now.a[i]);
  }

  Sampler& shape_;
  const SphereTree& probes_;
  const Similarity& map_;
  Workspace::Impl& scratch_;
  Budget budget_;
  ProbeTally tally_;
};

}  // namespace ist
