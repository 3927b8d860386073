#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/kernel/subtree_kernel.h"
#include "query/shape/probe_sum.h"
#include "query/tree_overlap/answer.h"

namespace ist {

/// The result of a descent of a tree against a surface: balls that were summed, nodes that are
/// wholly inside, and nodes that were not opened, which may be either. With bins all of it is
/// sorted into them too.
class ProbeTally {
 public:
  /// All arguments must outlive the tally.
  ProbeTally(const SphereTree& probes, const RelativePose& pose, ContactBins* bins) noexcept
      : probes_(probes), pose_(pose), map_(pose.a_from_b), bins_(bins) {}

  /// A leaf block, its balls summed.
  void add(std::uint32_t block, const ProbeTotal& part) noexcept {
    total_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, 0, block, part.overlap);
  }

  /// Spheres that meet a triangle, or that a shape was asked about.
  void count(std::uint32_t pairs) noexcept { pairs_ += pairs; }

  /// Nodes that are inside.
  void hold(int level, const std::uint32_t* nodes, std::size_t n) noexcept {
    add_subtrees(probes_, level, nodes, n, held_);
    if (bins_ == nullptr) return;
    for (std::size_t i = 0; i < n; ++i) {
      SubtreeSums sums;
      add_subtrees(probes_, level, nodes + i, 1, sums);
      bins_->add_guess(0, 0, level, nodes[i], whole_spheres(sums, map_));
    }
  }

  /// A node that is not opened: the answer is a guess then.
  void leave(int level, std::uint32_t block) noexcept {
    const NodeBall ball = probes_.ball(level, block);
    double centre[3];
    map_.apply(ball.centre, centre);
    Overlap part;
    part.volume = 0.5 * volume_of(level, block);
    part.moment = part.volume * Eigen::Vector3d(centre[0] - map_.t[0], centre[1] - map_.t[1],
                                                centre[2] - map_.t[2]);
    left_ += 2 * part.volume;
    guess_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, level, block, part);
    stopped_ = true;
  }

  /// The volume of a node's spheres, the surface's unit frame.
  double volume_of(int level, std::uint32_t block) const noexcept {
    return probes_.sums(level, block).volume * (map_.scale * map_.scale * map_.scale);
  }

  /// The answer in world units. `off`: by how much the surface may be elsewhere, its unit frame.
  Penetration answer(double off, std::uint32_t visits) const noexcept {
    Overlap sum = sure();
    sum.error = 2 * off * total_.area + 1e-13 * (total_.crossed + sum.volume);
    const double scale = map_.scale;
    const double most = probes_.header->volume_sum * (scale * scale * scale) * (1 + 1e-9);
    const double lowest = std::max(0.0, sum.volume - sum.error);
    const double highest =
        std::max(lowest, std::min(most, sum.volume + sum.error + (1 + 1e-9) * left_));
    add_guess(sum);
    Penetration result = world_answer(sum, lowest, highest, pose_);
    result.node_visits = visits;
    result.sphere_pairs = pairs_ + held_.spheres;
    if (stopped_) result.status = QueryStatus::budget_exhausted;
    return result;
  }

 private:
  Overlap sure() const noexcept {
    Overlap sum = total_.overlap;
    sum.add(whole_spheres(held_, map_));
    return sum;
  }

  /// Half of what is left, where it is. The push grows with the volume, as far as anybody can tell.
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
  SubtreeSums held_;
  double left_ = 0;  ///< volume of what was left: the sum may be more by this
  Overlap guess_;    ///< half of it
  std::uint32_t pairs_ = 0;
  bool stopped_ = false;
};

}  // namespace ist
