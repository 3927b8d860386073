#pragma once

#include <cstdint>

#include <ist/query.h>

#include "query/asset/sphere_tree.h"
#include "query/asset/surface_tree.h"
#include "query/base/budget.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/descent/workspace.h"
#include "query/field/probe_tally.h"
#include "query/kernel/node_kernel.h"

namespace ist {

/// The volume that the spheres of B have inside the surface of A, each sphere's part being exact:
/// V = Σ_j |b_j ∩ A| (docs/design.md 7).
///
/// The balls of a surface as a tree whose spheres are blocks of triangles.
TreeHeader ball_header(const SurfaceTree& surface);
SphereTree ball_tree(const SurfaceTree& surface, const TreeHeader& header);

/// Whether a stage opens the surface's nodes, those of ball_tree(), or the probing tree's. `scale`:
/// of these in the surface's frame.
bool opens_surface(const SphereTree& balls, int surface_level, const SphereTree& probes,
                   int probe_level, double scale) noexcept;

/// Level by level, pairs of a node of B and a node of A's surface; those of one node of B stand
/// together. A node of B that is left without a partner is all inside or all outside.
class SurfaceDescent {
 public:
  /// All arguments must outlive the descent; `pose`: of A, which has the surface, and B, which
  /// probes. With `bins`, which are B's, what is summed is sorted into them too.
  SurfaceDescent(const SurfaceTree& surface, const SphereTree& probes, const RelativePose& pose,
                 const DescentLimits& limits, Workspace::Impl& scratch,
                 ContactBins* bins = nullptr) noexcept;

  void run() noexcept;

  /// The answer in world units.
  Penetration penetration() const noexcept;

 private:
  bool open_surface() noexcept;
  bool open_probes() noexcept;
  void sum_leaves() noexcept;

  /// The sums of a leaf block of B with blocks of the surface, pairs [from, to) of the list.
  ProbeTotal sum_block(std::uint32_t block, std::size_t from, std::size_t to) noexcept;

  /// Which children of the nodes of B come near their partners; false if the budget ends.
  bool reach_children() noexcept;
  std::uint32_t any_of(std::size_t from, std::size_t to) const noexcept;

  /// The same, triangle by triangle, for the pairs [from, to) of one node of B; children that meet
  /// nothing are settled. Returns those that do, a bit each.
  std::uint32_t sort_children(std::size_t from, std::size_t to, std::uint32_t used) noexcept;

  /// No surface is nearer than this to the centre of a node of B without partners.
  double clear_radius(int level, std::uint32_t block) const noexcept;

  /// The balls that come near a block of triangles, a bit each.
  std::uint32_t near_block(const ProbeBalls& balls, std::uint32_t a) const noexcept;

  /// Which of the `wanted` balls have their centres inside. `met`, `told`, `inside`: what is known
  /// of all; pairs [from, to) are theirs, and masks of the triangles that come near.
  std::uint32_t sides(const ProbeBalls& balls, std::uint32_t wanted, std::uint32_t met,
                      std::uint32_t told, std::uint32_t inside, int triangles, std::size_t from,
                      std::size_t to) const noexcept;

  /// A node of B that meets no surface.
  void settle(int level, std::uint32_t block) noexcept;

  /// Children of a node of B that meet no surface; pairs [from, to) are the node's.
  void settle_children(const ProbeBalls& balls, std::uint32_t block, std::uint32_t children,
                       std::size_t from, std::size_t to) noexcept;

  /// A node of B that is inside.
  void keep(int level, std::uint32_t block) noexcept;
  void flush() noexcept;

  /// First pair of the next node of B.
  std::size_t group_end(std::size_t from) const noexcept;

  /// Leaves what is in the list from a pair on unopened.
  void leave(std::size_t from) noexcept;

  /// The same, and all of the next list, which is a level of B further down.
  void leave_both(std::size_t from) noexcept;

  const SurfaceTree& surface_;
  const SphereTree& probes_;
  const RelativePose& pose_;
  const Similarity& map_;
  TreeHeader ball_header_;
  SphereTree balls_;  ///< of the surface; its "spheres" are blocks of triangles
  const Precision precision_;
  Workspace::Impl& scratch_;
  Budget budget_;
  int surface_level_, probe_level_;
  ProbeTally tally_;
  static constexpr std::size_t kSettled = 64;
  std::uint32_t settled_[kSettled];
  std::size_t settled_count_ = 0;
  int settled_level_ = 0;
};

}  // namespace ist
