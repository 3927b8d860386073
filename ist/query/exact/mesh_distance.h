#pragma once

#include <cstdint>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// The gap between two meshes, A's unit frame.
struct MeshGap {
  double distance = 0;          ///< of the nearest points that were found
  double least = 0;             ///< no two points are nearer, roundings included
  exact::Point a = {}, b = {};  ///< these points
  bool overlap = false;         ///< surfaces cross, or one solid holds a shell of the other
  bool stopped = false;         ///< by the budget, or for want of room
  std::uint32_t tests = 0;      ///< pairs of triangles measured
};

/// Branch and bound over both trees of boxes, always the nearest pair that waits. A visit opens one
/// node, or measures two blocks. Allocates, locks and throws nothing; the same answer on every
/// instruction set.
MeshGap mesh_gap(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b,
                 const Similarity& b_from_a, Budget& budget, ExactScratch& scratch) noexcept;

}  // namespace ist
