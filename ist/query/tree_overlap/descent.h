#pragma once

#include <cstddef>

#include <ist/query.h>

#include "query/asset/sphere_tree.h"
#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/kernel/leaf_kernel.h"
#include "query/kernel/node_kernel.h"
#include "query/kernel/overlap.h"
#include "query/scratch/workspace.h"

namespace ist {

/// True if a stage opens A's nodes: the larger ones. `scale`: of B in A's unit frame.
bool opens_a(const SphereTree& a, int level_a, const SphereTree& b, int level_b,
             double scale) noexcept;

/// The staged traversal of docs/design.md 7: node pairs level by level, then pairs of leaf blocks.
class Descent {
 public:
  /// All arguments must outlive the traversal. `bins`, unless null, get the sums too.
  Descent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
          const DescentLimits& limits, Workspace::Impl& scratch, ContactBins* bins = nullptr);

  void run() noexcept;

  Penetration penetration() const noexcept;

  Precision precision() const { return precision_; }

 private:
  /// The sum and the estimate of the unopened pairs.
  Overlap overlap() const;

  /// The sum without estimates.
  Overlap sure() const;

  /// Opens one side of every pair of the current list; false if a limit stopped it.
  bool open_level();

  /// Opens pairs [from, from + n) of the current list into the next. Adds up the nodes that a
  /// sphere of the other side contains instead.
  void open_pairs(const NodeStage& stage, bool open_a, std::size_t from, std::size_t n);

  /// Adds the spheres below nodes of A, or of B, each in a sphere of the other side.
  void add_contained(bool of_a, int level, const ContainedNodes& contained);

  /// The overlap of spheres of A, or of B, that lie in spheres of the other side.
  Overlap contained_overlap(bool of_a, const SubtreeSums& contained) const;

  void open_leaves();

  void add_leaves(std::size_t from, std::size_t n);

  /// If the current list is longer than the visits left, moves the pairs of the largest bounds to
  /// its front. Both parts stay in order, since neighbours share nodes.
  void choose();

  void estimate_unopened(const PairList& list, std::size_t from);

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
  SubtreeSums contained_a_, contained_b_;  ///< nodes in spheres of the other tree
  Overlap unopened_;                       ///< estimate of unopened pairs
  double unopened_bound_ = 0;              ///< bound on their volume
  bool stopped_ = false;
};

}  // namespace ist
