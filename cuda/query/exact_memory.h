#pragma once

#include <cstddef>
#include <cstdint>

#include "base/bits.h"
#include "cuda/query/exact_arrays.h"
#include "cuda/query/exact_pair.h"
#include "query/base/pair_place.h"
#include "query/exact/block_insides.h"
#include "query/exact/box_integrals.h"
#include "query/exact/exact_sums.h"

namespace ist::gpu {

/// Four numbers that are read and written at once.
struct alignas(16) Quad {
  float x[4];
};

constexpr std::uint32_t kExactWaiting = 64;  ///< pairs of triangles to be sifted

/// What a team keeps at hand of a pair.
struct ExactPair : ExactFrame {
  MeshTree mesh[2];
  const FloatBlock* in_floats[2];
  Quad row[2][3];   ///< of the map to the other's frame, the shift last
  Quad turn[2][3];  ///< of the other's axes from one's own

  /// A vertex in A's frame.
  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    const double* const x = in_global_memory(mesh[side].vertices) + std::size_t{3} * number;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(place.a_from_b, at);
  }
  /// Of a triangle, 16 · block + lane, the k-th corner.
  IST_HD exact::Point corner(int side, std::uint32_t triangle, int k) const {
    const MeshBlock& block = in_global_memory(mesh[side].blocks)[triangle / kWidth];
    return vertex(side, block.vertex[block.corner[k][triangle % kWidth]]);
  }
};

/// A child of a node, or a node alone. Own boxes are wider by the reach. Of these, as of triangles,
/// an odd number of quads, so that lanes that read one each do not meet in a bank.
struct ExactBox {
  Quad low, high;              ///< in the solid's own frame; last its slab, A's frame
  Quad other_low, other_high;  ///< in the other's
  Quad normal;                 ///< of the slab, A's frame
  Quad turned;  ///< of A's: what a side of B's box, of length 1, reaches along the normal
  std::uint32_t lane;
};

/// A triangle in A's frame, in floats.
struct ExactTriangle {
  Quad low, high;  ///< its box; A's is wider by the slack
  Quad plane;      ///< a point is so high over it, times twice the area: x · normal + last

  /// Heights above it are certain, wherever points move by the room.
  IST_HD float& margin() { return low.x[3]; }
  IST_HD float margin() const { return low.x[3]; }
  /// Its lane in its block, and in bytes its corners' places there.
  IST_HD void call(std::uint32_t name) { high.x[3] = float_of(name); }
  IST_HD std::uint32_t name() const { return bits_of(high.x[3]); }
};
static_assert(sizeof(ExactBox) % 32 == 16 && sizeof(ExactTriangle) % 32 == 16);

/// What a team that searches keeps beside the pair.
struct ExactSearchMemory {
  static constexpr std::uint32_t kWaiting = 192;  ///< pairs of nodes, of the first pass
  ExactBox boxes[2][kWidth];                      ///< of each side what may meet the other
  ExactTriangle triangles[2][kWidth];             ///< likewise
  float vertices[3][2]
                [kWidth];  ///< of two blocks, A's frame: lanes read them from banks of their own
  std::uint64_t waiting[kWaiting];
  ExactPool pool;
  ExactChain crossing, near;   ///< triangles that may cross; others whose signs are not settled
  std::uint32_t last_near[2];  ///< blocks of the last lane, if near
  std::uint32_t inverse[kWidth + 1];      ///< of a number of columns, times 2^16
  std::uint32_t queue[kExactWaiting][2];  ///< triangles to be sifted, 16 · block + lane
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
  union {
    CornerMemory corners;
    struct {
      InsideStack stack;
      alignas(BlockInsides) std::byte insides[32][sizeof(BlockInsides)];  ///< of a lane's record
    };
  };
  exact::Point origin;
  ExactLeft left;
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

/// Of faces that lie on each other, a lane's.
struct ContactSums {
  enum { kArea, kNormal, kMoment = kNormal + 3, kCount = kMoment + 3 };
  double of[kCount][32];
  CornerMemory corners;
};
struct ExactContactMemory : ExactSearchMemory {
  ContactSums contact;
};

/// Of a team that does all, one after the other.
struct ExactWholeMemory {
  ExactPair pair;
  union {
    ExactContactMemory search;
    ExactSumMemory sum;
    PieceMemory pieces;  ///< of its patches
  };
};

}  // namespace ist::gpu
