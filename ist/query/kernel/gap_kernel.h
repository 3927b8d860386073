#pragma once

#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "query/kernel/node_kernel.h"

namespace ist {

/// Tree x as it is looked at from tree y's nodes.
struct GapSide {
  GapSide(const SphereTree& x_tree, const SphereTree& y_tree, const Similarity& map)
      : x(&x_tree), y(&y_tree), x_from_y(&map) {
    for (int i = 0; i < 9; ++i) float32[i] = static_cast<float>(map.m[i]);
  }
  const SphereTree* x;
  const SphereTree* y;
  const Similarity* x_from_y;
  float float32[9];  ///< x_from_y->m, as most queries need it
};

/// Gaps of the sixteen children of a node of x and a node of y, in x's unit frame: between the
/// balls and between their cover balls. Huge in an unused lane.
struct ChildGaps {
  double gap[kWidth];
  double cover[kWidth];
  std::uint32_t near;  ///< a bit a child: all that do not reach both limits, and perhaps others
};

void child_gaps(const GapSide& side, int level_x, std::uint32_t block_x, int level_y,
                std::uint32_t block_y, double gap_limit, double cover_limit, Precision precision,
                ChildGaps& out) noexcept;

/// Which of sixteen balls hold a point of their block's frame: a bit each. `depth`: of all, the
/// squared radius less the squared distance.
std::uint32_t balls_around(const BallBlock& balls, const float (&point)[3],
                           float (&depth)[kWidth]) noexcept;

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
