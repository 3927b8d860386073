#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// Two placed meshes whose distance is wanted. All lengths are in A's unit frame.
struct GapQuestion {
  const MeshTree& a;
  const MeshTree& b;
  const Similarity& a_from_b;
  const Similarity& b_from_a;
  double most = HUGE_VAL;           ///< larger distances need not be found
  double enough = -1;               ///< the search may stop at a distance this small
  double likely = HUGE_VAL;         ///< an upper bound, unless a solid contains the other
  exact::Point toward = {0, 0, 0};  ///< unit, from A to B near where they are nearest; or zero
  KeptPairs* kept = nullptr;        ///< the kept state of this pair; null if there is none
  bool outside = false;  ///< no solid contains a shell of the other, unless surfaces cross
};

/// The gap between two meshes, A's unit frame.
struct MeshGap {
  double distance = 0;          ///< of the nearest points found
  double least = 0;             ///< no two points are nearer, roundings included
  exact::Point a = {}, b = {};  ///< these points
  bool overlap = false;         ///< surfaces cross, or one solid contains a shell of the other
  bool farther = false;         ///< than `most`
  bool stopped = false;         ///< by the budget
  std::uint32_t tests = 0;      ///< pairs of triangles measured
};

/// Branch and bound over both trees of boxes, depth first, the nearest child first. A visit opens
/// one node, or measures two blocks. Among pairs of triangles that are equally near up to rounding,
/// the one with the lowest numbers answers. So neither the order of the search nor what is kept
/// under `pair_id` matters. Allocates, locks and throws nothing. The answer is the same on every
/// instruction set.
MeshGap mesh_gap(const GapQuestion& question, Budget& budget, ExactScratch& scratch) noexcept;

}  // namespace ist
