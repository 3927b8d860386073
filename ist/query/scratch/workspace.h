#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "query/base/hooked_memory.h"
#include "query/contact/contact_bins.h"
#include "query/exact/exact_scratch.h"
#include "query/kernel/placed_blocks.h"

namespace ist {

/// A pair of nodes with the bound by which it is ranked.
struct RankedPair {
  double bound;
  std::uint32_t a, b;
};

/// A pair of nodes whose gap is still to be looked at.
struct WaitingPair {
  double gap;    ///< no spheres below are nearer than this, but for rounding
  double cover;  ///< likewise no cover balls
  std::uint32_t a, b;
  std::int32_t level_a, level_b;
  double order = 0;  ///< of two that wait the lesser one comes first
};

/// List of node pairs, one block index a side.
struct PairList {
  HookedArray<std::uint32_t> a, b;
  std::size_t size = 0;
};

/// Depth-first, a descent of two trees of seven levels waits on 15 children a level at most.
inline constexpr std::size_t kWaiting = 16 * 2 * kMaxLevels;

struct [[gnu::visibility("hidden")]] Workspace::Impl {
  Impl(std::size_t capacity, const MemoryHooks& memory);

  MemoryHooks memory;    ///< of all of this, and of this itself
  std::size_t capacity;  ///< pairs in each list
  PairList now, next;    ///< pairs of the current pair of levels; those of the next
  HookedArray<RankedPair> ranked;
  HookedArray<double> bounds;        ///< of the pairs of `now`, while some are chosen
  HookedArray<WaitingPair> waiting;  ///< [kWaiting] a stack
  Hooked<LeafScratch> leaves;
  HookedArray<std::uint16_t> masks;  ///< children of a pair's node that meet the other one
  ContactBins contact;
  ExactScratch exact;
#ifndef NDEBUG
  std::atomic<const void*> user{nullptr};  ///< of the thread that asks now
#endif
};

/// A query uses the workspace. In a debug build two threads that use one at a time end the program
/// with a message, and not later with what they wrote into each other's lists.
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
