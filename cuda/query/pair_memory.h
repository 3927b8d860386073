#pragma once

#include <cstdint>

#include "cuda/query/lens_sums.h"
#include "cuda/query/tree_ref.h"
#include "query/base/pair_place.h"

namespace ist::gpu {

constexpr int kPairsAtOnce = 2;  ///< item k of 32 is child, or sphere, k % 16 of pair k / 16
constexpr int kItems = kPairsAtOnce * static_cast<int>(kWidth);
constexpr int kAhead = 24;  ///< pairs readied together, a lane each
/// The largest growth of the stack in a step that takes two pairs.
constexpr int kGrowth = kItems - kPairsAtOnce;
constexpr int kFirstStack = OpeningSteps::kMost * kGrowth + kPairsAtOnce;
constexpr int kTaskStack = 120;  ///< on top of what waits for other tasks
constexpr int kStackSize = kFirstStack + kTaskStack;
/// Pairs of leaves are visited before kAhead or more are pending.
constexpr int kLeafCapacity = 224;
static_assert(kLeafCapacity >= kAhead + kItems);
constexpr int kNodeBits = 28;  ///< of a node's number; the rest of a word is the step
constexpr std::uint32_t kNodeMask = (1u << kNodeBits) - 1;
static_assert(kMaxSpheres == 1u << kNodeBits && OpeningSteps::kMost < 16);

constexpr float kTolerance = 2e-6f;  ///< share of a distance, above its rounding

struct alignas(16) Ball {
  float x, y, z, r;
};

/// Node pairs to be opened: the data that their children share.
struct OpeningPairs {
  Ball other[kAhead];  ///< the side that stays whole, seen from the block that is opened
  const BallBlock* block[kAhead];
  /// The entry that child 0 leaves on the stack or in the list of leaves.
  std::uint32_t a[kAhead], b[kAhead];
  std::uint32_t how[kAhead];  ///< flags, and from kLevelBit on the children's level
};
constexpr int kLevelBit = 8;
constexpr std::uint32_t kOpensA = 1;
constexpr std::uint32_t kToLeaf = 2;   ///< children are leaves
constexpr std::uint32_t kIntoOne = 4;  ///< the other side is a single sphere

/// Pairs of leaves to be visited, along A's axes from the origin of A's block.
struct MeetingPairs {
  Ball near_a[kAhead], near_b[kAhead];  ///< the leaves' balls
  Ball off[kAhead];  ///< the origin of B's block; r: the error of two spheres' distance
  std::uint32_t block_a[kAhead], block_b[kAhead];
  std::uint32_t lanes[kAhead];  ///< the spheres of a leaf, those of A in the low half
};

/// The state of a team for a pair of trees.
struct PairMemory {
  PairPlace place;
  TreeRef tree[2];
  OpeningSteps steps;
  Ball turn[3];                     ///< rows of place.a_from_b.m; r of the first: its scale
  std::uint32_t share[kWidth + 1];  ///< k · share[n] >> 16 is k / n, for k < 256
  /// Lengths are summed times this power of two, which scales the smaller tree to about 1, so that
  /// their powers fit into floats.
  double unit;
  double blur;                        ///< the rounding of a centre, A's unit frame
  bool to_single;                     ///< some leaves are single spheres
  LensTotals totals;                  ///< of the current task
  LensTotals sum;                     ///< of finished tasks
  std::uint32_t task_weight;          ///< size_tasks()
  std::uint32_t stack_a[kStackSize];  ///< node of A and the step, << kNodeBits, that opens the pair
  std::uint32_t stack_b[kStackSize];
  std::uint32_t leaf_a[kLeafCapacity], leaf_b[kLeafCapacity];
  union {
    OpeningPairs opening;
    MeetingPairs meeting;
  };
  Ball near[2][kItems];  ///< spheres that reach the other block's ball, pair by pair
  std::uint32_t number[2][kItems];
  std::uint32_t list_a[2 * 32], list_b[2 * 32];  ///< numbers of spheres that may meet
};

}  // namespace ist::gpu
