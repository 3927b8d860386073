#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"

// What exact batches keep of each pair from call to call: all pairs of triangles that a search may
// find while B has not moved by more than a margin.

namespace ist::gpu {

/// How far B moves against A: its box's centre, and what is turned about it by its distance. A's
/// unit frame.
struct KeptMotion {
  double shift, turn;

  IST_HD static KeptMotion of(const MeshTree& b, const Similarity& from, const Similarity& to) {
    double centre[3], at[3], to_at[3], shift = 0, turn = 0;
    for (int k = 0; k < 3; ++k) centre[k] = 0.5 * (double{b.low[k]} + b.high[k]);
    from.apply(centre, at);
    to.apply(centre, to_at);
    for (int k = 0; k < 3; ++k) shift += (to_at[k] - at[k]) * (to_at[k] - at[k]);
    for (int k = 0; k < 9; ++k) turn += (to.m[k] - from.m[k]) * (to.m[k] - from.m[k]);
    // Of a rotation less 1 all entries' squares are twice the square of what it does.
    return {std::sqrt(shift), std::sqrt(0.5 * turn) / from.scale};
  }
};

enum class KeptState : std::uint32_t {
  none,   ///< to be searched
  fresh,  ///< to be searched and kept
  holds,
};

/// What is kept of a pair. All zero: nothing.
struct KeptHead {
  std::uint64_t mesh[2];  ///< hashes of the assets
  Similarity last;        ///< B in A in the last call
  Similarity found_at;    ///< when the list was made
  KeptMotion margin;      ///< that it may have moved since
  double steps;           ///< that the next margin is made for
  KeptState state;
  std::uint32_t rest;       ///< calls that make no list, after lists that had no room
  std::uint32_t blocks;     ///< pairs of blocks
  std::uint32_t triangles;  ///< of theirs
};

/// Pairs of blocks from the front on, two words each; their pairs of triangles from the end on
/// backwards, two bytes each: 256 · the place of the pair of blocks modulo 256 + 16 · A's lane +
/// B's. Each pair of blocks has some.
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

/// Of a round, in turn.
struct KeptRound {
  std::uint32_t fresh, taken;  ///< queries to be searched and kept
};

/// What batches keep of pairs by their places.
struct ExactKept {
  std::byte* memory;
  std::uint32_t pairs;
  std::uint32_t bytes;  ///< each
  KeptRound* rounds;    ///< two
  std::uint32_t* list;  ///< fresh queries of a round

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
