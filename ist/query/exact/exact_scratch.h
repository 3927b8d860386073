#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <ist/asset_layout.h>

#include "query/base/hooked_memory.h"
#include "query/exact/exact_sums.h"
#include "query/exact/kept_pairs.h"
#include "query/exact/orientation.h"

namespace ist {

/// Boxes of a box block in the other solid's frame.
struct alignas(64) PlacedBoxes {
  float low[3][kWidth], high[3][kWidth];
  float normal[3][kWidth];                    ///< turned
  float slab_low[kWidth], slab_high[kWidth];  ///< along it, there
  float all_low[3], all_high[3];
};

/// The vertices of a block in A's unit frame.
struct alignas(64) PlacedVertices {
  double at[3][kWidth];           ///< [axis] B's: rounded once after the motion
  std::uint16_t corners[kWidth];  ///< of a triangle: a bit a vertex
};

/// The triangles of a block in A's unit frame, in floats.
struct alignas(64) PlacedTriangles {
  float low[3][kWidth], high[3][kWidth];  ///< boxes, rounded outward; unused lanes empty
  float corner[3][3][kWidth];             ///< [corner][axis]
  float normal[3][kWidth];                ///< product of two sides
  float offset[kWidth];                   ///< the plane's offset along the normal
  float length[kWidth];                   ///< an upper bound of the normal's length
  float slack[kWidth];                    ///< the error of the normal
  float all_low[3], all_high[3];
  float size;   ///< no two points are further apart
  float reach;  ///< no coordinate is larger
};

/// The planes of a block's triangles in A's unit frame. All of one triangle is in few cache lines.
struct alignas(64) PlacedPlanes {
  struct PointAnd {
    exact::Point point;
    double number;
  };
  /// The first corner, and a bound of the sums of the absolute products in the normal.
  PointAnd corner[kWidth];
  PointAnd normal[kWidth];  ///< product of two sides, and a bound of the coordinates of these
  /// Along the plane out of the triangle, which lies below the number; its absolute coordinates add
  /// up to 1, except for rounding.
  PointAnd edge[3][kWidth];
  /// The block's vertices are between these heights above the plane of `widest`, times the length
  /// of its normal.
  double low, high;
  std::uint32_t widest;  ///< the largest triangle
};

/// The parts of a mesh that recent queries have placed.
struct PlacedMesh {
  PlacedCache<PlacedBoxes, 256> boxes;
  PlacedCache<PlacedVertices, 256> vertices;
  PlacedCache<PlacedTriangles, 256> triangles;
  PlacedCache<PlacedPlanes, 256> planes;

  void forget() noexcept {
    planes.forget();
    boxes.forget();
    vertices.forget();
    triangles.forget();
  }
};

/// Eight pairs of triangles that are tested together.
struct alignas(64) TrianglePairs {
  /// [A, B][corner][axis]. Lanes without a pair are computed too, so they must be finite.
  double corner[2][3][3][8] = {};
  std::uint32_t triangle[2][8] = {};
  std::uint32_t count = 0;
  std::uint32_t unmarked = 0;  ///< a bit a pair: its blocks may have to be marked as near
};

/// A pending pair of nodes.
struct BoxPair {
  std::uint32_t a, b;
  std::uint8_t level_a, level_b;
};

/// A pending pair of nodes, and a lower bound of its distance.
struct GapPair {
  double squared;
  float order;  ///< pairs with smaller numbers are searched first
  std::uint32_t a, b;
  std::uint8_t level_a, level_b;
};

/// A block whose triangles cross others, with the vertices that are inside the other solid.
struct CrossedBlock {
  std::uint32_t block;
  std::uint16_t inside;       ///< a bit a local vertex
  std::uint64_t pierced;      ///< bit 3 · lane + edge
  double vertex[3][kWidth];   ///< [axis] from the origin of the sums
  std::uint8_t apex[kWidth];  ///< for each lane the corner, 0 … 2, that is nearest to the origin
  std::uint8_t fan[3][kWidth];  ///< for each lane its corners from there on, as local vertices
  // For each edge that is pierced:
  std::int8_t sum[3 * kWidth];     ///< its entries less its exits
  std::int8_t first[3 * kWidth];   ///< 1 if it enters first, −1 if it leaves first, 0 if unclear
  std::int8_t middle[3 * kWidth];  ///< `sum` over the half nearer to its first corner
  double first_t[3 * kWidth], first_error[3 * kWidth];

  exact::Point at(std::uint32_t v) const noexcept {
    return {vertex[0][v], vertex[1][v], vertex[2][v]};
  }
};

/// The common segments of crossing triangles, each number in an array of its own, so that eight are
/// summed together. A's edges leave B at a segment's start (end 0) and enter it at its end (end 1).
/// B's edges enter A at the start and leave it at the end.
class Crossings {
 public:
  /// Eight are loaded and stored at once, so up to seven more are touched.
  Crossings(std::uint32_t most, const MemoryHooks& hooks)
      : capacity_((most + 15) / 8 * 8),
        numbers_(hooked_array<double>(hooks, std::size_t{kNumbers} * capacity_)),
        triangle_(hooked_array<std::uint32_t>(hooks, 2 * std::size_t{capacity_})) {}

  /// The numbers of an end, where an edge of one solid pierces a triangle of the other. All
  /// segments that end there have the same bits.
  enum EndNumber {
    kFrom = 0,         ///< x, y, z of the end of the edge that is nearer to the triangle's plane
    kOffset = 3,       ///< from there to the crossing: stays accurate next to the end
    kT = 6,            ///< the position along the edge, from its first corner in this triangle
    kTError = 7,       ///< of t
    kHeightError = 8,  ///< heights of the edge's ends over the triangle, times twice its area, are
                       ///< off by this together
    kEdge = 9,  ///< its number: A's 0 … 2, B's 3 … 5; and 8 if `from` is its first corner
    kEndNumbers = 10
  };
  double* end(int e, int number) noexcept { return at(kEndNumbers * e + number); }
  const double* end(int e, int number) const noexcept { return at(kEndNumbers * e + number); }
  /// The apex of a triangle's cones, relative to the origin of the sums.
  double* apex(int side, int axis) noexcept { return at(2 * kEndNumbers + 3 * side + axis); }
  const double* apex(int side, int axis) const noexcept {
    return at(2 * kEndNumbers + 3 * side + axis);
  }
  /// If an end's edge is opposite to its triangle's apex: 1 if it enters, −1 if it leaves; else 0.
  double* opposite(int e) noexcept { return at(2 * kEndNumbers + 6 + e); }
  const double* opposite(int e) const noexcept { return at(2 * kEndNumbers + 6 + e); }
  /// Triangles: 16 · block + lane.
  std::uint32_t& triangle(int side, std::uint32_t i) noexcept { return triangle_[2 * i + side]; }
  std::uint32_t triangle(int side, std::uint32_t i) const noexcept {
    return triangle_[2 * i + side];
  }

  /// Moves the crossings from `from` on, fewer than eight, to the front.
  void move_to_front(std::uint32_t from, std::uint32_t count) noexcept {
    for (int number = 0; number < kNumbers; ++number)
      std::copy_n(at(number) + from, count, at(number));
    std::copy_n(triangle_.get() + 2 * std::size_t{from}, 2 * std::size_t{count}, triangle_.get());
  }

  /// Clears crossings [from, to), so that they add nothing to a sum.
  void clear(std::uint32_t from, std::uint32_t to) noexcept {
    for (int number = 0; number < kNumbers; ++number)
      std::fill(at(number) + from, at(number) + to, 0.0);
  }

  CrossingEnd end_of(std::uint32_t i, int e) const noexcept {
    const auto code = static_cast<std::uint32_t>(static_cast<int>(end(e, kEdge)[i]));
    const std::uint32_t of_b = (code % 8 + 1) / 4;
    return {triangle_[2 * i + of_b], code % 8 - 3 * of_b, of_b != 0, code >= 8,
            static_cast<std::uint32_t>(e) != of_b};
  }
  /// The position of an end relative to `origin`.
  exact::Point place_of(std::uint32_t i, int e, const exact::Point& origin) const noexcept {
    return (exact::Point{end(e, kFrom)[i], end(e, kFrom + 1)[i], end(e, kFrom + 2)[i]} - origin) +
           exact::Point{end(e, kOffset)[i], end(e, kOffset + 1)[i], end(e, kOffset + 2)[i]};
  }

 private:
  static constexpr int kNumbers = 2 * kEndNumbers + 8;
  double* at(int number) noexcept { return numbers_.get() + std::size_t{capacity_} * number; }
  const double* at(int number) const noexcept {
    return numbers_.get() + std::size_t{capacity_} * number;
  }

  std::uint32_t capacity_;
  HookedArray<double> numbers_;
  HookedArray<std::uint32_t> triangle_;
};

/// The bit of a block or shell.
inline bool has(const HookedArray<std::uint64_t>& bits, std::uint32_t i) noexcept {
  return bits[i / 64] >> i % 64 & 1;
}
inline void set(HookedArray<std::uint64_t>& bits, std::uint32_t i) noexcept {
  bits[i / 64] |= std::uint64_t{1} << i % 64;
}

/// The state of one solid's blocks in a query.
struct BlockMarks {
  /// A bit for each block: its signs might differ if the surfaces moved within the tolerance.
  HookedArray<std::uint64_t> near;
  HookedArray<std::uint64_t> crossed;  ///< triangles of it cross others: it is in `blocks`
  HookedArray<std::uint64_t> pierced;  ///< edges of it are pierced
  HookedArray<std::uint64_t> inside;   ///< no edge is pierced, and it lies inside
  HookedArray<std::uint64_t> shells;   ///< a bit a shell: edges of it are pierced
  HookedArray<std::uint32_t> place;    ///< the index in `blocks` of a crossed block
  HookedArray<CrossedBlock> blocks;
  std::uint32_t count = 0;
};

/// Scratch memory of exact queries, a part of a workspace, whose capacity determines its size.
struct ExactScratch {
  ExactScratch(std::size_t capacity, const MemoryHooks& hooks)
      : most_blocks(static_cast<std::uint32_t>(std::min<std::size_t>(capacity, 1u << 24))),
        most_crossed(most_blocks / 64 + 8),
        most_crossings(most_blocks / 16 + 128),
        placed_a(hooked<PlacedMesh>(hooks)),
        placed_b(hooked<PlacedMesh>(hooks)),
        pairs(hooked<TrianglePairs>(hooks)),
        waiting(hooked_array<BoxPair>(hooks, kMostWaiting)),
        gaps(hooked_array<GapPair>(hooks, kMostWaiting)),
        crossings(most_crossings, hooks),
        kept(most_pairs(), hooks),
        near(most_crossings, hooks),
        keys(hooked_array<std::uint64_t>(hooks, most_pairs())),
        other_keys(hooked_array<std::uint64_t>(hooks, most_pairs())),
        flood(hooked_array<std::uint32_t>(hooks, most_blocks)),
        ends(hooked_array<PiercedEnd>(hooks, 2 * std::size_t{most_crossings})),
        curves(hooked_array<CurveExtent>(hooks, most_crossings)),
        parent(hooked_array<std::uint32_t>(hooks, elements())),
        part(hooked_array<std::uint32_t>(hooks, elements())),
        middles(hooked_array<std::uint32_t>(hooks, 2 * 3 * kWidth * std::size_t{most_crossed})),
        parts(hooked_array<ExactPart>(hooks, PartMemory::kMostParts)),
        octants(hooked_array<ExactPart>(hooks, PartMemory::kMostParts)),
        octant_sums(hooked_array<OctantSums>(hooks, 8 * PartMemory::kMostSplit)) {
    placed_a->forget();
    for (BlockMarks* marks : {&a, &b}) {
      for (HookedArray<std::uint64_t>* bits :
           {&marks->near, &marks->crossed, &marks->pierced, &marks->inside, &marks->shells})
        *bits = hooked_array<std::uint64_t>(hooks, most_blocks / 64 + 1);
      marks->place = hooked_array<std::uint32_t>(hooks, most_blocks);
      marks->blocks = hooked_array<CrossedBlock>(hooks, most_crossed);
    }
  }

  /// Bound of the pending node pairs: a depth-first search leaves 255 others at each level, and
  /// both trees are opened together.
  static constexpr std::uint32_t kMostWaiting = 256 * 2 * kMaxLevels;

  /// Drops everything that was placed for another pose: all but A's triangles in A's own frame.
  void forget(std::uint64_t mesh_a) noexcept {
    placed_b->forget();
    placed_a->boxes.forget();
    if (std::exchange(hash_a, mesh_a) != mesh_a) placed_a->forget();
  }

  /// The capacity for pairs of blocks or triangles that are kept for later.
  std::uint32_t most_pairs() const noexcept { return 16 * most_crossings; }

  /// The number of elements: crossings, vertices of crossed blocks, and blocks of both solids.
  std::size_t elements() const noexcept {
    return most_crossings + 2 * kWidth * std::size_t{most_crossed} + 2 * std::size_t{most_blocks};
  }

  std::uint32_t most_blocks;     ///< of a mesh
  std::uint32_t most_crossed;    ///< blocks of a mesh that cross the other
  std::uint32_t most_crossings;  ///< pairs of triangles
  Hooked<PlacedMesh> placed_a, placed_b;
  std::uint64_t hash_a = 0;  ///< of the asset of `placed_a`
  Hooked<TrianglePairs> pairs;
  HookedArray<BoxPair> waiting;
  HookedArray<GapPair> gaps;
  Crossings crossings;
  KeptRing kept;  ///< pairs of triangles that may cross
  KeptRing near;  ///< pairs of blocks that may be the nearest
  HookedArray<std::uint64_t> keys, other_keys;
  HookedArray<std::uint32_t> flood;
  // For parts:
  HookedArray<PiercedEnd> ends;
  HookedArray<CurveExtent> curves;
  HookedArray<std::uint32_t> parent, part;  ///< of an element
  HookedArray<std::uint32_t> middles;       ///< of an edge of a crossed block, A's first
  HookedArray<ExactPart> parts, octants;
  HookedArray<OctantSums> octant_sums;
  PieceMemory pieces;
  BlockMarks a, b;

  PartMemory part_memory() noexcept {
    return {ends.get(),        curves.get(),          keys.get(),
            other_keys.get(),  parent.get(),          part.get(),
            middles.get(),     parts.get(),           octants.get(),
            octant_sums.get(), PartMemory::kMostParts};
  }
};

}  // namespace ist
