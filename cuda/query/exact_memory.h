#pragma once

#include <cstdint>

#include "cuda/query/exact_arrays.h"
#include "query/base/pair_place.h"
#include "query/exact/box_integrals.h"

namespace ist::gpu {

constexpr std::uint32_t kExactWaiting = 64;  ///< pairs of triangles, of a stage
constexpr float kExactFar = 3e38f;  ///< where what is not there lies: beyond any ratio of sizes

/// Children of a node, or a node alone: boxes and slabs.
struct ExactBoxes {
  float low[3][kWidth], high[3][kWidth];                         ///< in the solid's own frame
  float other_low[3][kWidth], other_high[3][kWidth];             ///< in the other's
  float normal[3][kWidth], slab_low[kWidth], slab_high[kWidth];  ///< A's frame
  float turned[3][kWidth];  ///< of A's: what a side of B's box, of length 1, reaches along a normal
};

/// Boxes of a block's triangles, A's frame.
struct ExactTriangles {
  float at[3][kWidth];  ///< vertices
  float low[3][kWidth], high[3][kWidth];
};

/// What a lane has summed: a volume in two parts, vectors in three.
struct ExactSum {
  enum {
    kHigh,
    kLow,
    kRounding,
    kLayers,
    kMoment,
    kPush = kMoment + 3,
    kTurn = kPush + 3,
    kCount = kTurn + 3
  };
};

/// What a team keeps at hand of a pair.
struct ExactMemory {
  PairPlace place;
  MeshTree mesh[2];
  exact::Point aside, origin;
  double moved[2];   ///< no point of a surface is further from where it ought to be
  float reach[2];    ///< boxes that are as near are opened: A's frame, B's
  float pad[2];      ///< what rounding does to boxes of A in B's frame, of B in A's
  float slack;       ///< and to slabs
  float map[2][12];  ///< to the other's frame: 3 × 3 row by row, then the shift
  float turn[9];     ///< A's axes from B's
  union {
    ExactBoxes boxes[2];
    ExactTriangles triangles[2];
    InsideStack stack;
  };
  std::uint8_t left[2][kWidth];              ///< of each side what may meet the other
  int count[2];                              ///< how many
  std::uint32_t queue[2][kExactWaiting][2];  ///< of each stage: triangles, 16 · block + lane
  double sum[ExactSum::kCount][32];
  std::uint32_t flooded;  ///< blocks, of one side

  /// Six times a volume that a lane adds.
  IST_HD void add(int lane, double six) {
    double rest;
    exact::two_sum(sum[ExactSum::kHigh][lane], six, sum[ExactSum::kHigh][lane], rest);
    sum[ExactSum::kLow][lane] += rest;
  }
  IST_HD void add(int lane, int of, const exact::Point& x) {
    for (int k = 0; k < 3; ++k) sum[of + k][lane] += x[k];
  }
  /// A vertex in A's frame.
  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    const double* const x = in_global_memory(mesh[side].vertices) + std::size_t{3} * number;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(place.a_from_b, at);
  }
};

}  // namespace ist::gpu
