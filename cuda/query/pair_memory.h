#pragma once

#include <cstdint>

#include "cuda/query/lens_sums.h"
#include "cuda/query/pair_place.h"
#include "cuda/query/tree_ref.h"

namespace ist::gpu {

constexpr int kPairsAtOnce = 2;  ///< item k of 32 is child, or sphere, k % 16 of pair k / 16
constexpr int kItems = kPairsAtOnce * static_cast<int>(kWidth);
constexpr int kAhead = 16;  ///< pairs readied together, a lane each
/// A step leaves at most so many pairs more than it takes.
constexpr int kGrowth = kItems - kPairsAtOnce;
constexpr int kStackRoom = OpeningSteps::kMost * kGrowth + kPairsAtOnce;
/// Pairs of leaves are met before kAhead and more wait.
constexpr int kLeafRoom = 192;
static_assert(kLeafRoom >= kAhead + kItems);
constexpr int kNodeBits = 28;  ///< of a node's number; the rest of a word is the step
static_assert(kMaxSpheres == 1u << kNodeBits && OpeningSteps::kMost < 16);

struct alignas(16) Ball {
  float x, y, z, r;
};

/// Node pairs about to be opened: what of them does not change from child to child.
struct OpeningPairs {
  Ball other[kAhead];  ///< the side that stays whole, seen from the block that is opened
  const BallBlock* block[kAhead];
  std::uint32_t a[kAhead], b[kAhead];  ///< as on the stack
};

/// Pairs of leaves about to be met, in A's axes from A's block's origin.
struct MeetingPairs {
  Ball near_a[kAhead], near_b[kAhead];  ///< the leaves' balls
  Ball off[kAhead];  ///< of B's block's origin; r: by how much two spheres' distance may be off
  std::uint32_t block_a[kAhead], block_b[kAhead];
  std::uint32_t lanes[kAhead];  ///< that a leaf has, of A in the low half
};

/// What a team needs for a pair of trees.
struct PairMemory {
  PairPlace place;
  TreeRef tree[2];
  OpeningSteps steps;
  float turn[9];  ///< place.a_from_b.m
  /// Lengths are summed times this power of two, about the smaller tree's size to 1: their powers
  /// then fit into floats.
  double unit;
  LensTotals totals;
  std::uint32_t stack_a[kStackRoom];  ///< node of A and the step, << kNodeBits, that opens the pair
  std::uint32_t stack_b[kStackRoom];
  std::uint32_t leaf_a[kLeafRoom], leaf_b[kLeafRoom];
  union {
    OpeningPairs opening;
    MeetingPairs meeting;
  };
  Ball near[2][kItems];  ///< spheres that reach the other block's ball, pair by pair
  std::uint32_t number[2][kItems];
  std::uint32_t list_a[2 * 32], list_b[2 * 32];  ///< numbers of spheres that may meet
};

}  // namespace ist::gpu
