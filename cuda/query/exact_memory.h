#pragma once

#include <cstddef>
#include <cstdint>

#include "base/bits.h"
#include "cuda/query/exact_arrays.h"
#include "cuda/query/exact_pair.h"
#include "query/base/pair_place.h"
#include "query/exact/box_integrals.h"
#include "query/exact/exact_sums.h"
#include "query/exact/inside_search.h"

namespace ist::gpu {

/// Four numbers that are loaded and stored together.
struct alignas(16) Quad {
  float x[4];
};

constexpr std::uint32_t kExactWaiting = 64;  ///< pairs of triangles to be tested in double

/// A pair in a team's fast memory.
struct ExactPair : ExactFrame {
  MeshTree mesh[2];
  const FloatBlock* in_floats[2];
  Quad row[2][3];   ///< of the map to the other's frame, the translation last
  Quad turn[2][3];  ///< rotation to the other's axes

  /// A vertex in A's frame.
  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    const double* const x = in_global_memory(mesh[side].vertices) + std::size_t{3} * number;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(place.a_from_b, at);
  }
  /// The k-th corner of a triangle (16 · block + lane), A's frame.
  IST_HD exact::Point corner(int side, std::uint32_t triangle, int k) const {
    const MeshBlock& block = in_global_memory(mesh[side].blocks)[triangle / kWidth];
    return vertex(side, block.vertex[block.corner[k][triangle % kWidth]]);
  }
};

/// A child of a node, or a node itself. Its own box is wider by the reach. The number of quads is
/// odd, as in ExactTriangle, so that lanes that read one object each use different banks.
struct ExactBox {
  Quad low, high;  ///< in the solid's own frame; the last number bounds the slab, A's frame
  Quad other_low, other_high;  ///< in the other's frame
  Quad normal;                 ///< of the slab, A's frame
  Quad turned;  ///< for A's: the extent along the normal of a side of B's box of length 1
  std::uint32_t lane;
};

/// A triangle in A's frame, in floats.
struct ExactTriangle {
  Quad low, high;  ///< its box, that of A widened by the slack
  Quad plane;      ///< x · normal + last is a point's height times twice the area

  /// Heights above this have a certain sign, wherever points move within the tolerance.
  IST_HD float& margin() { return low.x[3]; }
  IST_HD float margin() const { return low.x[3]; }
  /// The lane in its block and, a byte each, the positions of its corners there.
  IST_HD void call(std::uint32_t name) { high.x[3] = float_of(name); }
  IST_HD std::uint32_t name() const { return bits_of(high.x[3]); }
};
static_assert(sizeof(ExactBox) % 32 == 16 && sizeof(ExactTriangle) % 32 == 16);

/// The memory of a team that searches, without the pair's.
struct ExactSearchMemory {
  static constexpr std::uint32_t kWaiting = 192;  ///< pending pairs of nodes in the first pass
  ExactBox boxes[2][kWidth];           ///< the nodes of each side that may intersect the other
  ExactTriangle triangles[2][kWidth];  ///< the triangles of each side that may intersect the other
  float vertices[3][2][kWidth];  ///< of two blocks, A's frame: lanes read them from separate banks
  std::uint64_t waiting[kWaiting];
  ExactPool pool;
  ExactChain crossing,
      near;  ///< triangles that may cross; others whose signs might differ if points moved
  std::uint32_t last_near[2];             ///< the blocks of the last lane, if near
  std::uint32_t inverse[kWidth + 1];      ///< 2^16 divided by a number of columns
  std::uint32_t queue[kExactWaiting][2];  ///< triangles to be tested in double, 16 · block + lane
  std::uint8_t found[kWidth * kWidth];    ///< intersecting pairs of leaf boxes, 16 · A's + B's
  std::uint8_t met[kWidth * kWidth];  ///< intersecting pairs of triangles' boxes, 16 · A's + B's
};

/// The sums of a lane: a volume in two parts, vectors of three numbers.
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

/// The memory of a team that sums, without the pair's.
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

  /// Adds six times a volume to a lane's sum.
  IST_HD void add(int lane, double six) {
    double rest;
    exact::two_sum(sum[ExactSum::kHigh][lane], six, sum[ExactSum::kHigh][lane], rest);
    sum[ExactSum::kLow][lane] += rest;
  }
  IST_HD void add(int lane, int of, const exact::Point& x) {
    for (int k = 0; k < 3; ++k) sum[of + k][lane] += x[k];
  }
};

/// The sums of a lane over faces that lie on each other.
struct ContactSums {
  enum { kArea, kNormal, kMoment = kNormal + 3, kCount = kMoment + 3 };
  double of[kCount][32];
  CornerMemory corners;
};
struct ExactContactMemory : ExactSearchMemory {
  ContactSums contact;
};

/// The memory of a team that does all steps of a pair.
struct ExactWholeMemory {
  ExactPair pair;
  union {
    ExactContactMemory search;
    ExactSumMemory sum;
    PieceMemory pieces;  ///< of its patches
  };
};

}  // namespace ist::gpu
