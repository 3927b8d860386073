#pragma once

#include <cstdint>

#include "query/base/relative_pose.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// Two placed meshes whose crossing triangles are looked for.
struct CrossingSearch {
  const MeshTree* a;
  const MeshTree* b;
  Similarity a_from_b;  ///< unit frames
  Similarity b_from_a;
  float room = 0;                ///< A's unit frame: what is this near counts as near
  std::uint32_t max_visits = 0;  ///< pairs of nodes; 0: no limit
};

struct CrossingsFound {
  std::uint32_t crossings = 0;  ///< in ExactScratch::crossings, in any order
  std::uint32_t visits = 0;     ///< pairs of nodes opened
  std::uint32_t tests = 0;      ///< pairs of triangles tested by signs
  bool complete = true;         ///< no limit or room was short
  bool consistent = true;       ///< signs agree with each other
};

/// Finds all pairs of triangles that cross, and marks blocks that may be near the other solid
/// (`near` of both sides, which is zero before). The same crossings on every instruction set.
CrossingsFound find_crossings(const CrossingSearch& search, ExactScratch& scratch) noexcept;

}  // namespace ist
