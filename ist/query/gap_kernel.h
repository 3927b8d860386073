#pragma once

#include <cstdint>

#include "query/node_kernel.h"
#include "query/relative_pose.h"
#include "query/sphere_tree.h"

namespace ist {

/// Tree x as it is looked at from tree y's nodes.
struct GapSide {
  const SphereTree* x;
  const SphereTree* y;
  const Similarity* x_from_y;
};

/// Gaps of the sixteen children of a node of x and a node of y, in x's unit frame: between the
/// balls and between their cover balls. Huge in an unused lane.
struct ChildGaps {
  double gap[kWidth];
  double cover[kWidth];
};

void child_gaps(const GapSide& side, int level_x, std::uint32_t block_x, int level_y,
                std::uint32_t block_y, Precision precision, ChildGaps& out) noexcept;

/// Least gaps between the spheres of two leaf blocks, in x's unit frame.
struct LeafGap {
  double gap;
  double cover;
  std::uint32_t lane_x, lane_y;  ///< of the least gap; the lowest among equals
};

/// Spheres of x whose gaps to y's leaf ball reach both limits are left out.
LeafGap leaf_gap(const GapSide& side, std::uint32_t block_x, std::uint32_t block_y,
                 double gap_limit, double cover_limit, Precision precision) noexcept;

}  // namespace ist
