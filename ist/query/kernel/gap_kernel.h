#pragma once

#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/precision.h"

namespace ist {

/// Two trees; x is opened.
struct GapSide {
  GapSide(const SphereTree& x_tree, const SphereTree& y_tree, const Similarity& map,
          Precision digits)
      : x(&x_tree), y(&y_tree), x_from_y(&map), precision(digits) {
    for (int i = 0; i < 9; ++i) float32[i] = static_cast<float>(map.m[i]);
  }
  const SphereTree* x;
  const SphereTree* y;
  const Similarity* x_from_y;
  Precision precision;
  float float32[9];  ///< x_from_y->m
};

/// Gaps of the sixteen children of a node of x and a node of y, in x's unit frame: between the
/// balls and between their cover balls. Huge in an unused lane.
struct ChildGaps {
  double gap[kWidth];
  double cover[kWidth];
  std::uint32_t near;  ///< a bit for each child below one of the limits, and perhaps for others
};

void child_gaps(const GapSide& side, TreeNode x, TreeNode y, double gap_limit, double cover_limit,
                ChildGaps& out) noexcept;

/// A bit for each ball that contains a point of their block's frame. `depth`: r² − d² of each ball.
std::uint32_t balls_around(const BallBlock& balls, const float (&point)[3],
                           float (&depth)[kWidth]) noexcept;

/// Least gaps between the spheres of two leaf blocks, in x's unit frame.
struct LeafGap {
  double gap;
  double cover;
  std::uint32_t lane_x, lane_y;  ///< of the least gap; the lowest among equals
};

/// Skips spheres of x whose gap to y's leaf ball is not below either limit.
LeafGap leaf_gap(const GapSide& side, std::uint32_t block_x, std::uint32_t block_y,
                 double gap_limit, double cover_limit) noexcept;

}  // namespace ist
