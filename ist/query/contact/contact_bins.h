#pragma once

#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/hooked_memory.h"
#include "query/contact/tree_cuts.h"
#include "query/kernel/leaf_kernel.h"
#include "query/kernel/overlap.h"

namespace ist {

/// The part of the overlap in one node of the binned tree.
struct ContactBin {
  std::uint32_t node;  ///< block of the bins' level
  Overlap sum;
  double pull;             ///< |sum.force|
  Eigen::Vector3d centre;  ///< of sum.volume; zero without volume
};

/// A part of a contact while it is divided: a region of the tree, and bins order[begin … end).
struct ContactPart {
  double loss = 0;  ///< error of one patch in its place; the largest is divided next
  std::uint64_t id = 0;
  TreeRegion region;
  std::uint32_t begin = 0, end = 0;
};

/// The sums of a query by the nodes of one level of one of its trees: scratch of contact_patches(),
/// part of a Workspace. Memory is not touched before use.
class ContactBins {
 public:
  static constexpr std::uint32_t kBins = kMostContactBins;

  explicit ContactBins(const MemoryHooks& memory);

  /// Empties the bins. They are the tree's leaf blocks, or the nodes of its first level of no more
  /// than kBins. `of_b`: the tree is B's.
  void start(const SphereTree& tree, bool of_b) noexcept;

  /// Marks the bins of these pairs of leaves or spheres.
  LeafBinning touch(int level_a, const std::uint32_t* a, int level_b, const std::uint32_t* b,
                    std::size_t n) noexcept;

  /// Adds the known or estimated overlap of an unopened pair of nodes to the first bin below it.
  void add_guess(int level_a, std::uint32_t a, int level_b, std::uint32_t b,
                 const Overlap& guess) noexcept;

  /// Clears all but the guesses.
  void forget_sums() noexcept;

  /// Finishes every bin that is not empty, in order of nodes; returns how many.
  std::uint32_t collect(Precision precision) noexcept;

  const SphereTree& tree() const noexcept { return *tree_; }
  bool of_b() const noexcept { return of_b_; }
  int level() const noexcept { return level_; }
  const ContactBin* bins() const noexcept { return bins_.get(); }

  // Scratch of the division, [kBins] each.
  ContactPart* parts() noexcept { return parts_.get(); }
  std::uint32_t* order() noexcept { return order_.get(); }
  std::uint32_t* spare() noexcept { return spare_.get(); }

 private:
  void mark(std::uint32_t bin) noexcept;

  HookedArray<LeafSums> sums_;    ///< [kBins] constructed when a bin is first marked
  HookedArray<Overlap> guesses_;  ///< [kBins] likewise
  HookedArray<ContactBin> bins_;  ///< [kBins]
  HookedArray<ContactPart> parts_;
  HookedArray<std::uint32_t> order_, spare_;
  std::uint64_t marked_[kBins / 64] = {};
  const SphereTree* tree_ = nullptr;
  bool of_b_ = false;
  int level_ = 0;
};

}  // namespace ist
