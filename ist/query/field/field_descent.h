#pragma once

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/descent/answer.h"
#include "query/descent/workspace.h"
#include "query/field/patch_shapes.h"

namespace ist {

/// The volume that the spheres of a tree have inside a field that tells how far its surface is.
/// Level by level; a node whose ball the surface does not reach is in or out as a whole.
template <class Shape>
class FieldDescent {
 public:
  /// `pose`: of the field, in its own frame, and of the tree. All arguments must outlive the
  /// descent.
  FieldDescent(Shape& shape, const SphereTree& probes, const RelativePose& pose,
               const DescentLimits& limits, Workspace::Impl& scratch,
               ContactBins* bins = nullptr) noexcept
      : shape_(shape),
        probes_(probes),
        pose_(pose),
        map_(pose.a_from_b),
        limits_(limits),
        min_radius_(limits.min_radius / pose.unit_a),
        scratch_(scratch),
        bins_(bins),
        budget_(limits) {}

  void run() noexcept {
    PairList& now = scratch_.now;
    now.a[0] = 0;
    now.size = 1;
    int level = probes_.top;
    for (; level > 0 && now.size > 0; --level) {
      if (accurate(level)) return leave(level, 0);
      if (!open(level)) return;
      std::swap(scratch_.now, scratch_.next);
    }
    for (std::size_t i = 0; i < now.size; ++i) {
      if ((limits_.relative_error > 0 && i % 16 == 0 && accurate(0)) || budget_.grant(1) == 0)
        return leave(0, i);
      waiting_ -= volume_of(0, now.a[i]);
      sum_block(now.a[i]);
    }
  }

  Penetration penetration() const noexcept {
    Overlap sum = total_.overlap;
    sum.add(whole_spheres(held_, map_));
    const double reach = map_.scale * probes_.header->root[3] +
                         Eigen::Vector3d(map_.t[0], map_.t[1], map_.t[2]).norm();
    const double off = shape_.error() + 1e-15 * reach;
    sum.error = 2 * off * total_.area + 1e-13 * (total_.crossed + sum.volume);
    const double cube = map_.scale * map_.scale * map_.scale;
    const double most = probes_.header->volume_sum * cube * (1 + 1e-9);
    const double lowest = std::max(0.0, sum.volume - sum.error);
    const double highest =
        std::max(lowest, std::min(most, sum.volume + sum.error + (1 + 1e-9) * left_.volume));
    left_.add_to(sum);
    Penetration result = world_answer(sum, lowest, highest, pose_);
    result.node_visits = budget_.visits();
    result.sphere_pairs = pairs_ + held_.spheres;
    if (stopped_) result.status = QueryStatus::budget_exhausted;
    return result;
  }

 private:
  double volume_of(int level, std::uint32_t block) const noexcept {
    return probes_.sums(level, block).volume * (map_.scale * map_.scale * map_.scale);
  }

  /// Opens the nodes of the current list; false if the budget ends, what is left being left then.
  bool open(int level) noexcept {
    const PairList& now = scratch_.now;
    PairList& next = scratch_.next;
    next.size = 0;
    waiting_ = 0;
    std::uint32_t held[kWidth];
    for (std::size_t i = 0; i < now.size; ++i) {
      const std::uint32_t block = now.a[i];
      if (min_radius_ > 0 && probes_.ball(level, block).r * map_.scale < min_radius_) {
        left_.add(probes_, level, block, map_, bins_);
        stopped_ = true;
        continue;
      }
      if (budget_.grant(1) == 0 || next.size + kWidth > scratch_.capacity) {
        leave(level, i);
        for (std::size_t k = 0; k < next.size; ++k)
          left_.add(probes_, level - 1, next.a[k], map_, bins_);
        return false;
      }
      ProbeBalls balls;
      place_probes(probes_, level, block, map_, balls);
      const std::uint32_t used = std::min(kWidth, probes_.count(level - 1) - kWidth * block);
      std::size_t count = 0;
      for (std::uint32_t lane = 0; lane < used; ++lane) {
        const Eigen::Vector3d x(balls.origin[0] + balls.x[lane], balls.origin[1] + balls.y[lane],
                                balls.origin[2] + balls.z[lane]);
        const double d = shape_.look(x).distance;
        const double reach = balls.r[lane] * (1 + 1e-6) + shape_.error();
        const std::uint32_t child = kWidth * block + lane;
        if (d <= -reach) continue;
        if (d >= reach) {
          held[count++] = child;
        } else {
          next.a[next.size++] = child;
          waiting_ += volume_of(level - 1, child);
        }
      }
      keep(level - 1, held, count);
    }
    return true;
  }

  void keep(int level, const std::uint32_t* nodes, std::size_t n) noexcept {
    add_subtrees(probes_, level, nodes, n, held_);
    if (bins_ == nullptr) return;
    for (std::size_t i = 0; i < n; ++i) {
      SubtreeSums sums;
      add_subtrees(probes_, level, nodes + i, 1, sums);
      bins_->add_guess(0, 0, level, nodes[i], whole_spheres(sums, map_));
    }
  }

  void sum_block(std::uint32_t block) noexcept {
    ProbeBalls balls;
    place_probes(probes_, 0, block, map_, balls);
    const std::uint32_t lanes = std::min(kWidth, probes_.header->sphere_count - kWidth * block);
    ProbeTotal part;
    if constexpr (requires { shape_.block(balls, lanes, map_.t, pairs_); }) {
      part = shape_.block(balls, (1u << lanes) - 1, map_.t, pairs_);
    } else {
      for (std::size_t i = 0; i < lanes; ++i) {
        const Eigen::Vector3d at(balls.origin[0] + balls.x[i], balls.origin[1] + balls.y[i],
                                 balls.origin[2] + balls.z[i]);
        const BallPart ball = shape_.part(at, balls.r[i]);
        if (!(ball.volume > 0)) continue;
        ++pairs_;
        add_part(at - Eigen::Vector3d(map_.t[0], map_.t[1], map_.t[2]), ball.volume, ball.gradient,
                 ball.moment, part.overlap);
        part.area += ball.area;
        if (ball.area > 0)
          part.crossed += 4 * std::numbers::pi / 3 * (balls.r[i] * balls.r[i] * balls.r[i]);
      }
    }
    total_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, 0, block, part.overlap);
  }

  bool accurate(int level) const noexcept {
    if (!(limits_.relative_error > 0) || level == probes_.top) return false;
    const double left = waiting_ + left_.volume;
    const double sure = total_.overlap.volume + whole_spheres(held_, map_).volume;
    return left <= limits_.relative_error * (sure + left);
  }

  void leave(int level, std::size_t from) noexcept {
    const PairList& now = scratch_.now;
    for (std::size_t i = from; i < now.size; ++i) left_.add(probes_, level, now.a[i], map_, bins_);
    stopped_ = true;
  }

  Shape& shape_;
  const SphereTree& probes_;
  const RelativePose& pose_;
  const Similarity& map_;
  const DescentLimits limits_;
  const double min_radius_;
  Workspace::Impl& scratch_;
  ContactBins* const bins_;
  Budget budget_;
  ProbeTotal total_;
  SubtreeSums held_;
  double waiting_ = 0;  ///< volume of the nodes of the current list
  LeftNodes left_;
  std::uint32_t pairs_ = 0;
  bool stopped_ = false;
};

}  // namespace ist
