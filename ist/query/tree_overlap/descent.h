#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/query.h>

#include "query/asset/sphere_tree.h"
#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/kernel/leaf_kernel.h"
#include "query/kernel/overlap.h"
#include "query/kernel/subtree_kernel.h"
#include "query/scratch/workspace.h"
#include "query/tree_overlap/unopened.h"

namespace ist {

/// Whether a stage opens A's nodes: those of the larger typical size. `scale`: of B in A's frame.
bool opens_a(const SphereTree& a, int level_a, const SphereTree& b, int level_b,
             double scale) noexcept;

/// The staged descent of docs/design.md 7: node pairs level by level, then pairs of leaf blocks.
class Descent {
 public:
  /// All arguments must outlive the descent. With `bins`, what is summed is sorted into them too.
  Descent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
          const DescentLimits& limits, Workspace::Impl& scratch, ContactBins* bins = nullptr);

  void run() noexcept;

  /// The answer in world units, from what has been summed.
  Penetration penetration() const noexcept;

  Precision precision() const { return precision_; }

 private:
  PairEstimate estimate(int level_a, std::uint32_t a, int level_b, std::uint32_t b) const {
    return estimate_pair(a_, level_a, a, b_, level_b, b, map_);
  }

  /// Best answer: what was summed and a guess of the rest.
  Overlap overlap() const;

  /// The summed part, without estimates.
  Overlap sure() const;

  /// Opens one side of every pair of the current list. False if the budget stopped it.
  bool open_level();

  /// Opens pairs [from, from + n) of the current list into the next. Nodes that a sphere of the
  /// standing side contains are added up instead.
  void open_pairs(const NodeStage& stage, bool open_a, std::size_t from, std::size_t n);

  /// Adds the spheres below nodes of A, or of B: each node lies in one sphere of the other side.
  void add_contained(bool of_a, int level, const ContainedNodes& contained);

  /// The part of spheres of A, or of B, that lie within a sphere of the other side.
  Overlap contained_overlap(bool of_a, const SubtreeSums& contained) const;

  void open_leaves();

  /// Sums pairs [from, from + n) of the current list.
  void add_leaves(std::size_t from, std::size_t n);

  /// Puts the pairs of largest bound that visits are left for first in the current list, if there
  /// are more. Otherwise they stay in order, as neighbours share nodes.
  void choose();

  /// Ranks the pairs of the current list, from the largest bound down.
  double bound(std::size_t i) const;

  /// Guesses the pairs from `from` on.
  void estimate_unopened(const PairList& list, std::size_t from);

  /// Guesses one pair that stays unopened.
  Overlap estimate_unopened_pair(std::uint32_t a, std::uint32_t b);

  const SphereTree& a_;
  const SphereTree& b_;
  const RelativePose& pose_;
  const Similarity& map_;
  Precision precision_;
  const DescentLimits limits_;
  Workspace::Impl& scratch_;
  ContactBins* const bins_;
  Budget budget_;
  int level_a_ = 0, level_b_ = 0;  ///< of the current list
  LeafSums sums_;
  SubtreeSums contained_a_, contained_b_;  ///< nodes that lie in a sphere of the other tree
  Overlap unopened_;                       ///< guess of what was not opened
  double unopened_bound_ = 0;              ///< what that can add at most
  bool stopped_ = false;
};

}  // namespace ist
