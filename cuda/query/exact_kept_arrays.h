#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"

// Candidates that exact batches keep for each pair from call to call: all pairs of triangles that a
// search may find until B has moved by more than a margin.

namespace ist::gpu {

/// The motion of B relative to A: that of its box's centre, and that of the rotation per distance
/// from the centre. A's unit frame.
struct KeptMotion {
  double shift, turn;

  IST_HD static KeptMotion of(const MeshTree& b, const Similarity& from, const Similarity& to) {
    double centre[3], at[3], to_at[3], shift = 0, turn = 0;
    for (int k = 0; k < 3; ++k) centre[k] = 0.5 * (double{b.low[k]} + b.high[k]);
    from.apply(centre, at);
    to.apply(centre, to_at);
    for (int k = 0; k < 3; ++k) shift += (to_at[k] - at[k]) * (to_at[k] - at[k]);
    for (int k = 0; k < 9; ++k) turn += (to.m[k] - from.m[k]) * (to.m[k] - from.m[k]);
    // The squared entries of a rotation minus the identity sum to twice the square of its largest
    // motion.
    return {std::sqrt(shift), std::sqrt(0.5 * turn) / from.scale};
  }
};

enum class KeptState : std::uint32_t {
  none,   ///< needs a search
  fresh,  ///< needs a search that keeps its candidates
  holds,
};

/// The state of a pair. All zero: nothing is kept.
struct KeptHead {
  std::uint64_t mesh[2];  ///< hashes of the assets
  Similarity last;        ///< the map from B to A in the last call
  Similarity found_at;    ///< the same when the list was made
  KeptMotion margin;      ///< the motion that is allowed since then
  double steps;           ///< the number of steps that the next margin allows for
  KeptState state;
  std::uint32_t rest;       ///< calls that make no list, after lists that did not fit
  std::uint32_t blocks;     ///< pairs of blocks
  std::uint32_t triangles;  ///< pairs of their triangles
};

/// The memory of a pair's list. Pairs of blocks fill it from the front, two words each. Their pairs
/// of triangles fill it from the end, two bytes each: 256 · the position of the pair of blocks
/// modulo 256 + 16 · A's lane + B's. Each pair of blocks has at least one.
struct KeptList {
  std::byte* memory;
  std::uint32_t bytes;

  IST_HD std::uint32_t* blocks(std::uint32_t n) const {
    return reinterpret_cast<std::uint32_t*>(memory) + std::size_t{2} * n;
  }
  IST_HD std::uint16_t& triangles(std::uint32_t n) const {
    return reinterpret_cast<std::uint16_t*>(memory)[bytes / 2 - 1 - n];
  }
  IST_HD bool hold(std::uint32_t block_pairs, std::uint32_t triangle_pairs) const {
    return 8 * std::uint64_t{block_pairs} + 2 * std::uint64_t{triangle_pairs} <= bytes;
  }
};

/// The counters of a round; two alternate.
struct KeptRound {
  std::uint32_t fresh, taken;  ///< queries whose search keeps candidates
};

/// The kept candidates of all pairs, by their position in the batch.
struct ExactKept {
  std::byte* memory;
  std::uint32_t pairs;
  std::uint32_t bytes;  ///< each
  KeptRound* rounds;    ///< two
  std::uint32_t* list;  ///< queries of a round that are `fresh`

  IST_HD KeptHead& head(std::uint32_t i) const {
    return *reinterpret_cast<KeptHead*>(memory + std::size_t{bytes} * i);
  }
  IST_HD KeptList list_of(std::uint32_t i) const {
    return {reinterpret_cast<std::byte*>(&head(i) + 1),
            bytes - static_cast<std::uint32_t>(sizeof(KeptHead))};
  }
  IST_HD KeptRound& round(std::uint32_t n) const { return rounds[n % 2]; }
};

}  // namespace ist::gpu
