#pragma once

#include <cstdint>

#include "cuda/query/exact_arrays.h"
#include "query/base/pair_place.h"
#include "query/exact/box_integrals.h"

namespace ist::gpu {

/// Four numbers that are read and written at once.
struct alignas(16) Quad {
  float x[4];
};

constexpr std::uint32_t kExactWaiting = 64;  ///< pairs of triangles to be sifted

/// What a team keeps at hand of a pair.
struct ExactPair : ExactFrame {
  MeshTree mesh[2];
  Quad row[2][3];   ///< of the map to the other's frame, the shift last
  Quad turn[2][3];  ///< of the other's axes from one's own

  /// A vertex in A's frame.
  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    const double* const x = in_global_memory(mesh[side].vertices) + std::size_t{3} * number;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(place.a_from_b, at);
  }
  IST_HD void load(int side, std::uint32_t triangle, exact::Point (&corners)[3]) const {
    const MeshBlock& block = in_global_memory(mesh[side].blocks)[triangle / kWidth];
    IST_ROLLED
    for (int k = 0; k < 3; ++k)
      corners[k] = vertex(side, block.vertex[block.corner[k][triangle % kWidth]]);
  }
};

/// A child of a node, or a node alone. Own boxes are wider by the reach.
struct ExactBox {
  Quad low, high;              ///< in the solid's own frame; last its slab, A's frame
  Quad other_low, other_high;  ///< in the other's
  Quad normal;                 ///< of the slab, A's frame
  Quad turned;  ///< of A's: what a side of B's box, of length 1, reaches along the normal
};

/// A triangle in A's frame, in floats.
struct ExactTriangle {
  Quad low, high;      ///< its box; A's is wider by the slack
  Quad plane;          ///< a point is so high over it, times twice the area: x · normal + last
  float margin;        ///< heights above which are certain, wherever points move by the room
  std::uint32_t name;  ///< its lane in its block, and in bytes its corners' places there
};

/// What a team that searches keeps beside the pair.
struct ExactSearchMemory {
  static constexpr std::uint32_t kWaiting = 128;  ///< pairs of nodes, of the first pass
  ExactBox boxes[2][kWidth];                      ///< of each side what may meet the other
  ExactTriangle triangles[2][kWidth];             ///< likewise
  Quad vertices[2][kWidth];
  std::uint64_t waiting[kWaiting];
  std::uint32_t queue[kExactWaiting][2];  ///< triangles to be sifted, 16 · block + lane
  std::uint8_t lane[2][kWidth];           ///< of the boxes
  std::uint8_t found[kWidth * kWidth];    ///< pairs of boxes of leaves that meet, 16 · A's + B's
  std::uint8_t met[kWidth * kWidth];      ///< of triangles, likewise
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

/// What a team that sums keeps beside the pair.
struct ExactSumMemory {
  InsideStack stack;
  exact::Point origin;
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
};

/// Of a team that does both, one after the other.
struct ExactWholeMemory {
  ExactPair pair;
  union {
    ExactSearchMemory search;
    ExactSumMemory sum;
  };
};

}  // namespace ist::gpu
