#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>

#include "query/base/hooked_memory.h"
#include "query/exact/crossing.h"

namespace ist {

/// Boxes of a box block in the other solid's frame.
struct alignas(64) PlacedBoxes {
  float low[3][kWidth], high[3][kWidth];
  float normal[3][kWidth];                    ///< turned
  float slab_low[kWidth], slab_high[kWidth];  ///< along it, there
  float all_low[3], all_high[3];
};

/// The triangles of a block in A's unit frame.
struct alignas(64) PlacedTriangles {
  double vertex[3][kWidth];               ///< [axis] B's: rounded once after the motion
  float low[3][kWidth], high[3][kWidth];  ///< boxes, rounded outward; unused lanes empty
  float corner[3][3][kWidth];             ///< [corner][axis]
  float normal[3][kWidth];                ///< product of two sides
  float offset[kWidth];                   ///< of the plane along it
  float length[kWidth];                   ///< of it, or more
  float slack[kWidth];                    ///< how far it may be off
  float all_low[3], all_high[3];
  float size;   ///< no two points are further apart
  float reach;  ///< no coordinate is larger
};

/// Places that hold what was placed last with a number of the same remainder.
template <class T, std::uint32_t kPlaces>
struct PlacedCache {
  std::uint32_t number[kPlaces];
  T placed[kPlaces];

  void forget() noexcept {
    for (std::uint32_t& n : number) n = ~0u;
  }
};

/// Eight pairs of triangles that are tested together.
struct alignas(64) TrianglePairs {
  double corner[2][3][3][8];  ///< [A, B][corner][axis]
  std::uint32_t vertex[2][3][8];
  std::uint32_t triangle[2][8];
  std::uint32_t count = 0;
};

/// A pair of nodes that waits.
struct BoxPair {
  std::uint32_t a, b;
  std::uint8_t level_a, level_b;
};

/// A block whose triangles cross others: which of its vertices are inside the other solid.
struct CrossedBlock {
  std::uint32_t block;
  std::uint16_t inside;         ///< a bit a local vertex
  std::uint64_t pierced;        ///< bit 3 · lane + edge
  exact::Point vertex[kWidth];  ///< from the origin of the sums
  std::uint8_t apex[kWidth];    ///< of each lane the corner, 0 … 2, that is nearest to the origin
  // Of a pierced edge:
  std::int8_t sum[3 * kWidth];     ///< how often it enters more than it leaves
  std::int8_t first[3 * kWidth];   ///< what comes first: 1 enters, −1 leaves, 0 unclear
  std::int8_t middle[3 * kWidth];  ///< `sum` of places that are nearer to its first corner
  double first_t[3 * kWidth], first_error[3 * kWidth];
};

/// One bit a block, or a shell.
inline bool has(const HookedArray<std::uint64_t>& bits, std::uint32_t i) noexcept {
  return bits[i / 64] >> i % 64 & 1;
}

/// What a query knows of the blocks of one solid.
struct BlockMarks {
  HookedArray<std::uint64_t> near;     ///< a bit a block: triangles of it may be near the other
  HookedArray<std::uint64_t> crossed;  ///< triangles of it cross others: it is in `blocks`
  HookedArray<std::uint64_t> pierced;  ///< edges of it are pierced
  HookedArray<std::uint64_t> inside;   ///< no edge is pierced, and it lies inside
  HookedArray<std::uint64_t> shells;   ///< a bit a shell: edges of it are pierced
  HookedArray<std::uint32_t> place;    ///< of crossed blocks, in `blocks`
  HookedArray<CrossedBlock> blocks;
  std::uint32_t count = 0;
};

/// What is summed of an overlap, or a part of it: from the origin, A's unit frame.
struct ExactSums {
  exact::CarefulSum six_volumes;
  exact::Point moment = {};  ///< 24 ∫ x
  exact::Point force = {};  ///< ∫ n dA over B's surface in A: the volume's gradient by translation
  exact::Point torque = {};  ///< ∫ x × n dA, likewise

  double volume() const noexcept { return six_volumes.value() / 6; }
};

/// A connected part of an overlap.
struct ExactPart {
  ExactSums sums;          ///< from the whole's origin
  std::uint64_t id = 0;    ///< lowest pair of triangles on its outline, from 1; 0: it has none
  std::uint32_t kept = 0;  ///< the part that it was added to, or itself
};

/// An edge where it is pierced.
struct PiercedEnd {
  std::uint64_t edge;
  double t;
  std::uint32_t crossing, other;
  bool of_b;
};

/// A curve where surfaces cross, if it lies in one triangle of a solid.
struct CurveExtent {
  std::uint32_t triangle;  ///< ~0: of several
  exact::Point low, high;  ///< its box
  exact::Point area;       ///< twice the vector of what it goes around
};

/// Scratch memory of exact queries, a part of a workspace: all of it grows with its capacity.
struct ExactScratch {
  ExactScratch(std::size_t capacity, const MemoryHooks& hooks)
      : most_blocks(static_cast<std::uint32_t>(std::min<std::size_t>(capacity, 1u << 24))),
        most_crossed(most_blocks / 256 + 8),
        most_crossings(most_blocks / 16 + 128),
        boxes_a(hooked<PlacedCache<PlacedBoxes, 256>>(hooks)),
        boxes_b(hooked<PlacedCache<PlacedBoxes, 256>>(hooks)),
        triangles_a(hooked<PlacedCache<PlacedTriangles, 256>>(hooks)),
        triangles_b(hooked<PlacedCache<PlacedTriangles, 256>>(hooks)),
        pairs(hooked<TrianglePairs>(hooks)),
        waiting(hooked_array<BoxPair>(hooks, kMostWaiting)),
        crossings(hooked_array<exact::Crossing>(hooks, most_crossings)),
        keys(hooked_array<std::uint64_t>(hooks, most_crossings)),
        order(hooked_array<std::uint32_t>(hooks, most_crossings)),
        other_order(hooked_array<std::uint32_t>(hooks, most_crossings)),
        flood(hooked_array<std::uint32_t>(hooks, most_blocks)),
        ends(hooked_array<PiercedEnd>(hooks, 2 * std::size_t{most_crossings})),
        curves(hooked_array<CurveExtent>(hooks, most_crossings)),
        parent(hooked_array<std::uint32_t>(hooks, elements())),
        part(hooked_array<std::uint32_t>(hooks, elements())),
        middles(hooked_array<std::uint32_t>(hooks, 2 * 3 * kWidth * std::size_t{most_crossed})),
        parts(hooked_array<ExactPart>(hooks, kMostParts)) {
    for (BlockMarks* marks : {&a, &b}) {
      for (HookedArray<std::uint64_t>* bits :
           {&marks->near, &marks->crossed, &marks->pierced, &marks->inside, &marks->shells})
        *bits = hooked_array<std::uint64_t>(hooks, most_blocks / 64 + 1);
      marks->place = hooked_array<std::uint32_t>(hooks, most_blocks);
      marks->blocks = hooked_array<CrossedBlock>(hooks, most_crossed);
    }
  }

  /// Node pairs wait depth first: 255 others a level, and both trees are opened together.
  static constexpr std::uint32_t kMostWaiting = 256 * 2 * kMaxLevels;

  static constexpr std::uint32_t kMostParts = 1024;

  /// Crossings, vertices of crossed blocks and blocks of both solids.
  std::size_t elements() const noexcept {
    return most_crossings + 2 * kWidth * std::size_t{most_crossed} + 2 * std::size_t{most_blocks};
  }

  std::uint32_t most_blocks;     ///< of a mesh
  std::uint32_t most_crossed;    ///< blocks of a mesh that cross the other
  std::uint32_t most_crossings;  ///< pairs of triangles
  Hooked<PlacedCache<PlacedBoxes, 256>> boxes_a, boxes_b;
  Hooked<PlacedCache<PlacedTriangles, 256>> triangles_a, triangles_b;
  Hooked<TrianglePairs> pairs;
  HookedArray<BoxPair> waiting;
  HookedArray<exact::Crossing> crossings;
  HookedArray<std::uint64_t> keys;
  HookedArray<std::uint32_t> order, other_order;
  HookedArray<std::uint32_t> flood;
  // Of parts:
  HookedArray<PiercedEnd> ends;
  HookedArray<CurveExtent> curves;
  HookedArray<std::uint32_t> parent, part;  ///< of an element
  HookedArray<std::uint32_t> middles;       ///< of an edge of a crossed block, A's first
  HookedArray<ExactPart> parts;
  BlockMarks a, b;
};

}  // namespace ist
