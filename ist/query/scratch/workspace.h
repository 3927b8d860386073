#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "query/base/budget.h"
#include "query/base/hooked_memory.h"
#include "query/contact/contact_bins.h"
#include "query/exact/exact_scratch.h"
#include "query/kernel/placed_blocks.h"

namespace ist {

struct RankedPair {
  double bound;
  std::uint32_t a, b;
};

/// A pair of nodes that waits to be opened.
struct WaitingPair {
  double gap;    ///< lower bound on the gap of spheres below, up to rounding
  double cover;  ///< the same for cover balls
  std::uint32_t a, b;
  std::int32_t level_a, level_b;
  double order = 0;  ///< the least is opened first
};

/// A list of node pairs, one block index per side.
struct PairList {
  HookedArray<std::uint32_t> a, b;
  std::size_t size = 0;
};

/// Depth first, a traversal of two trees leaves at most 15 children waiting per level.
inline constexpr std::size_t kWaiting = 16 * 2 * kMaxLevels;

struct [[gnu::visibility("hidden")]] Workspace::Impl {
  Impl(std::size_t capacity, const MemoryHooks& memory);

  MemoryHooks memory;    ///< of this and of all arrays
  std::size_t capacity;  ///< pairs in each list
  PairList now, next;    ///< pairs of the current pair of levels; those of the next
  HookedArray<RankedPair> ranked;
  HookedArray<double> bounds;        ///< of the pairs of `now` in Descent::choose()
  HookedArray<WaitingPair> waiting;  ///< [kWaiting] a stack
  Hooked<LeafScratch> leaves;
  HookedArray<std::uint16_t> masks;  ///< children of a pair's node that overlap the other node
  ContactBins contact;
  ExactScratch exact;
#ifndef NDEBUG
  std::atomic<const void*> user{nullptr};  ///< the thread of the current query
#endif
};

/// Depth-first branch and bound, nearest child first, for two minima at once: the gap between inner
/// spheres, and that between their cover balls.
class GapStack {
 protected:
  GapStack(Workspace::Impl& scratch, std::uint32_t most_visits, double gap_limit,
           double cover_limit) noexcept
      : budget_(most_visits), gap_(gap_limit), cover_(cover_limit), stack_(scratch.waiting.get()) {}

  bool wanted(double gap, double cover) const noexcept {
    return gap < gap_ || (cover_ > 0 && cover < cover_);
  }

  /// Adds a child of the pair that open() opens.
  [[gnu::always_inline]] void add(const WaitingPair& child) noexcept {
    std::size_t place = size_++;
    for (; place > first_ && stack_[place - 1].order < child.order; --place)
      stack_[place] = stack_[place - 1];
    stack_[place] = child;
  }

  /// Calls open(pair) while pairs are wanted and done() is false. Returns true if the limit of
  /// visits stopped it; then the pending pairs bound the gap of covers.
  template <class Open, class Done>
  bool search(const WaitingPair& root, const Open& open, const Done& done) noexcept {
    add(root);
    while (size_ > 0 && !done()) {
      const WaitingPair pair = stack_[size_ - 1];
      if (wanted(pair.gap, pair.cover)) {
        if (budget_.grant(1) == 0) break;
        first_ = --size_;
        open(pair);
      } else {
        --size_;
      }
    }
    const bool stopped = size_ > 0 && !done();
    for (std::size_t i = 0; stopped && i < size_; ++i) cover_ = std::min(cover_, stack_[i].cover);
    return stopped;
  }

  Budget budget_;
  double gap_;    ///< least so far, or the limit
  double cover_;  ///< the same for covers; 0: not wanted, or they touch

 private:
  WaitingPair* const stack_;
  std::size_t size_ = 0, first_ = 0;
};

/// Marks a workspace as in use by a query. A debug build aborts with a message if two threads use
/// one at a time, before they overwrite each other's lists.
class WorkspaceInUse {
 public:
#ifdef NDEBUG
  explicit WorkspaceInUse(Workspace&) noexcept {}
#else
  explicit WorkspaceInUse(Workspace& workspace) noexcept;
  ~WorkspaceInUse();
  WorkspaceInUse(const WorkspaceInUse&) = delete;

 private:
  Workspace::Impl* used_ = nullptr;  ///< null within another query of the thread
#endif
};

}  // namespace ist
