#pragma once

#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/hooked_memory.h"
#include "query/contact/tree_cuts.h"
#include "query/kernel/leaf_kernel.h"
#include "query/kernel/overlap.h"

namespace ist {

/// What one node of the binned tree has of the overlap.
struct ContactBin {
  std::uint32_t node;  ///< block of the bins' level
  Overlap sum;
  double pull;             ///< |sum.force|
  Eigen::Vector3d centre;  ///< of sum's volume; zero if that is 0
};

/// Part of a contact while it is divided: a region of the tree, and bins, order[begin … end).
struct ContactPart {
  double loss = 0;  ///< what taking it for one patch loses; the largest is divided next
  std::uint64_t id = 0;
  TreeRegion region;
  std::uint32_t begin = 0, end = 0;
};

/// The sums of a query sorted by the nodes of one of the two trees, at one level of it: scratch of
/// contact_patches, part of a Workspace. Memory is not touched before use.
class ContactBins {
 public:
  static constexpr std::uint32_t kBins = kMostContactBins;

  explicit ContactBins(const MemoryHooks& memory);

  /// Empties the bins. They are those of B if `of_b`: its leaf blocks, or the nodes of the first
  /// level of no more than kBins.
  void start(const SphereTree& tree, bool of_b) noexcept;

  /// Where the sums of these pairs of leaves or spheres go.
  LeafBinning touch(int level_a, const std::uint32_t* a, int level_b, const std::uint32_t* b,
                    std::size_t n) noexcept;

  /// Keeps what a pair of nodes holds or may hold that is not opened, in the first bin below it.
  void add_guess(int level_a, std::uint32_t a, int level_b, std::uint32_t b,
                 const Overlap& guess) noexcept;

  /// Forgets all but the guesses.
  void forget_sums() noexcept;

  /// Adds up every bin that holds anything, in order of nodes; returns how many.
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

  HookedArray<LeafSums> sums_;    ///< [kBins] made when a bin is first marked, as are
  HookedArray<Overlap> guesses_;  ///< [kBins]
  HookedArray<ContactBin> bins_;  ///< [kBins]
  HookedArray<ContactPart> parts_;
  HookedArray<std::uint32_t> order_, spare_;
  std::uint64_t marked_[kBins / 64] = {};
  const SphereTree* tree_ = nullptr;
  bool of_b_ = false;
  int level_ = 0;
};

}  // namespace ist
