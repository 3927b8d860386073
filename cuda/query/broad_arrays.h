#pragma once

#include <ist/types.h>
#include <cstddef>
#include <cstdint>

#include "base/bits.h"
#include "cuda/query/parts.h"
#include "query/base/solid_box.h"

struct CUstream_st;

namespace ist::gpu {

struct BroadBody {
  SolidBox box;  ///< scaled
  double wider;  ///< [u] on each side
  double scale;
  std::uint32_t world, solid, layers, meets;
  bool moves;
};

/// The box of some bodies and the range of their worlds. The box of no bodies intersects nothing.
struct alignas(16) BroadBox {
  float low[3];
  std::uint32_t first_world;
  float high[3];
  std::uint32_t last_world;

  IST_HD static BroadBox none() {
    return {{HUGE_VALF, HUGE_VALF, HUGE_VALF}, kNoIndex, {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF}, 0};
  }
  IST_HD bool meets(const BroadBox& other) const {
    return low[0] <= other.high[0] && other.low[0] <= high[0] && low[1] <= other.high[1] &&
           other.low[1] <= high[1] && low[2] <= other.high[2] && other.low[2] <= high[2] &&
           first_world <= other.last_world && other.first_world <= last_world;
  }
};

/// The number of children of a node, and of bodies in a lowest node.
constexpr std::uint32_t kFan = 32;
constexpr int kMostLevels = 7;  ///< 32⁷ > 2³¹

/// A hierarchy of boxes over bodies in the order of a curve that fills space: node j of level k + 1
/// has the nodes (of level 0: the bodies) 32 j … 32 j + 31 of level k.
struct BroadArrays {
  std::uint32_t count;  ///< of bodies
  const BroadBody* bodies;
  const Pose* poses;
  const std::uint64_t* excluded;  ///< keys of pairs, ascending
  std::uint32_t excluded_count;
  double cells;    ///< [1/u] of the curve
  int axis_bits;   ///< of a cell's coordinate
  int key_bits;    ///< of a position on the curve, the world in the highest bits
  int index_bits;  ///< of a body's index

  std::uint64_t *keys, *sorted_keys;      ///< [count]
  std::uint32_t *indices, *order;         ///< [count] 0, 1, …; sorted by keys
  BroadBox* placed;                       ///< [count] by index
  BroadBox* boxes[kMostLevels + 1];       ///< by level, padded to whole nodes
  std::uint32_t* still[kMostLevels + 1];  ///< by node: bit k: child k has bodies that do not move
  std::uint32_t nodes[kMostLevels + 1];   ///< by level; of level 0: bodies
  int top;                                ///< the level of one node

  std::uint32_t max_pairs;
  std::uint64_t *found, *sorted;  ///< [max_pairs] keys of pairs; all bits set: none
  std::uint32_t* met;             ///< [2] pairs found, `count` of the answer
  std::uint32_t *a, *b, *solid_a, *solid_b;
  Pose *pose_a, *pose_b;
  double *scale_a, *scale_b;
  QueryStatus* status;  ///< [count]
  std::byte* scratch;   ///< for sorting
  std::size_t scratch_bytes;

  IST_HD std::uint64_t key(std::uint32_t i, std::uint32_t j) const {
    return i < j ? std::uint64_t{i} << index_bits | j : std::uint64_t{j} << index_bits | i;
  }
};

/// Sets the arrays of a scene of `count` bodies to parts of a block of memory.
inline void place_broad(Parts& parts, BroadArrays& of) {
  BroadBody* const bodies = parts.take<BroadBody>(of.count);
  of.bodies = bodies;
  of.excluded = parts.take<std::uint64_t>(of.excluded_count);
  of.keys = parts.take<std::uint64_t>(of.count);
  of.sorted_keys = parts.take<std::uint64_t>(of.count);
  of.indices = parts.take<std::uint32_t>(of.count);
  of.order = parts.take<std::uint32_t>(of.count);
  of.placed = parts.take<BroadBox>(of.count);
  of.nodes[0] = of.count;
  of.top = 0;
  for (int k = 0; k == 0 || of.nodes[k] > 1; ++k) {
    const std::uint32_t above = (of.nodes[k] + kFan - 1) / kFan;
    of.boxes[k] = parts.take<BroadBox>(std::size_t{kFan} * above);
    of.still[k + 1] = parts.take<std::uint32_t>(above);
    of.nodes[k + 1] = above;
    of.top = k + 1;
  }
  of.found = parts.take<std::uint64_t>(of.max_pairs);
  of.sorted = parts.take<std::uint64_t>(of.max_pairs);
  of.met = parts.take<std::uint32_t>(2);
  for (std::uint32_t** const words : {&of.a, &of.b, &of.solid_a, &of.solid_b})
    *words = parts.take<std::uint32_t>(of.max_pairs);
  of.pose_a = parts.take<Pose>(of.max_pairs);
  of.pose_b = parts.take<Pose>(of.max_pairs);
  of.scale_a = parts.take<double>(of.max_pairs);
  of.scale_b = parts.take<double>(of.max_pairs);
  of.status = parts.take<QueryStatus>(of.count);
  of.scratch = parts.take<std::byte>(of.scratch_bytes);
}

/// The memory that sorting takes [bytes].
std::size_t broad_scratch_bytes(const BroadArrays& scene);
/// Sets the constant indices.
void ready_broad(const BroadArrays& scene, CUstream_st* stream);
void launch_broad(const BroadArrays& scene, CUstream_st* stream);

}  // namespace ist::gpu
