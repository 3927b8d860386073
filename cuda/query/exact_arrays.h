#pragma once

#include <ist/gpu.h>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cuda/query/batch_arrays.h"
#include "query/base/pair_place.h"
#include "query/exact/inside_search.h"
#include "query/exact/mesh_tree.h"

// The working memory of exact overlaps of a batch.

namespace ist::gpu {

/// The passes of a batch. The first works in rounds, with as many teams as the device runs. Pairs
/// that need more memory go to the later passes, which have fewer teams with more memory each.
constexpr int kExactPasses = 3;
/// [bytes] of a team's memory without that for the largest mesh.
IST_HD constexpr std::size_t exact_bytes(int pass) {
  return pass == 0 ? 80u << 10 : pass == 1 ? 512u << 10 : 16u << 20;
}

enum class ExactState : std::uint32_t {
  ok,
  nothing,        ///< answered, but the volume may be 0: do the solids touch?
  unsure,         ///< doubles do not decide
  out_of_memory,  ///< the team's memory does not suffice
  later,          ///< the round's memory is full
  wrong,          ///< signs are inconsistent
};

/// A round of the first pass. Its steps are small kernels: they place pairs, search for triangles
/// that may cross, sum by signs in doubles and, if these do not decide, by exact signs. Pairs
/// without volume are searched for faces that touch. A round ends when the memory for triangles is
/// full.
struct ExactRound {
  std::uint32_t first, count;                       ///< of the listed pairs
  std::uint32_t searched, summed, redone, touched;  ///< of these pairs, taken so far
  std::uint32_t found;                              ///< finished searches
  std::uint32_t unsure, nothing;                    ///< how many of them
  std::uint32_t chunks;                             ///< taken
};

/// The counters of a batch, initially zero.
struct ExactCounters {
  std::uint32_t listed[kExactPasses];  ///< pairs of each pass
  std::uint32_t taken[kExactPasses];
  ExactRound round[2];    ///< in turn
  std::uint32_t exactly;  ///< pairs summed by exact signs
};

/// Pairs of triangles (16 · block + lane) in the order in which they were found. A chain of chunks
/// stores those of one pair of solids.
struct ExactChunk {
  static constexpr std::uint32_t kPairs = 64;
  std::uint32_t pair[kPairs][2];
};
struct ExactChain {
  std::uint32_t first, last, count;
};
struct ExactPool {
  ExactChunk* chunks;
  std::uint32_t* next;   ///< of a chunk
  std::uint32_t* taken;  ///< how many
  std::uint32_t capacity;
};

/// The input of a pair's steps, computed by one thread.
struct ExactFrame {
  PairPlace place;
  exact::Point aside;
  double moved[2];  ///< bound of how far a point of each surface is from its true place
  double touch;     ///< solids within this distance touch
  float reach[2];   ///< boxes within this distance are opened, in A's frame and in B's
  float pad[2];     ///< rounding of A's boxes in B's frame, and of B's in A's
  float slack;      ///< rounding of slabs
};

/// The parts of a pair's sums that decide whether the solids touch, A's unit frame.
struct ExactLeft {
  double volume, error;  ///< a volume below 0 is rounding alone
  double push;           ///< no less than the force's length
};

/// A pair of a round, with the results that one step hands to the next.
struct ExactQuery {
  ExactFrame frame;
  std::uint32_t pair;  ///< in the batch
  ExactState state;
  std::uint32_t visits;
  ExactChain crossing,
      near;  ///< triangles that may cross; others whose signs might differ if points moved
  std::uint32_t unsure;   ///< in query k: the k-th query of the round that doubles do not decide
  std::uint32_t nothing;  ///< in query k: the k-th query that may have no volume
  ExactLeft left;         ///< of a query that may have no volume
};

/// A block with triangles that cross others.
struct CrossedRef {
  std::uint32_t block;
  std::uint16_t inside;  ///< a bit for each local vertex
  std::uint16_t of_b;
  std::uint32_t pierced[2];  ///< bit 3 · lane + edge, in two words
  /// For each edge, 2^16 times its entries less its exits, plus the same count over the half nearer
  /// to its first corner. Modulo 2^32, so that lanes may add in any order.
  std::uint32_t edge[3 * kWidth];

  IST_HD std::uint64_t all_pierced() const { return std::uint64_t{pierced[1]} << 32 | pierced[0]; }
  IST_HD int near_first(std::uint32_t e) const {
    return static_cast<std::int16_t>(edge[e] & 0xFFFFu);
  }
  IST_HD int sum(std::uint32_t e) const {
    return static_cast<std::int16_t>((edge[e] - static_cast<std::uint32_t>(near_first(e))) >> 16);
  }
};

/// A team's memory on the device.
struct ExactWorkspace {
  std::uint32_t* record[2];   ///< [blocks] the record of a block + 1, 0: none
  std::uint32_t* near[2];     ///< a bit for each block: signs might differ if points moved
  std::uint32_t* pierced[2];  ///< a bit for each block: some of its edges are pierced
  std::uint32_t* inside[2];   ///< a bit for each block: no edge is pierced, and it lies inside
  std::uint32_t* flood;       ///< [blocks]
  CrossedRef* records;
  std::uint32_t most_records;
  std::uint32_t words;  ///< of a bit for each block
  // Used by teams that also search.
  std::uint64_t* waiting;  ///< pairs of nodes: level and number of A's, then of B's
  std::uint32_t most_waiting;
  ExactPool pool;

  /// [bytes] for a mesh of `blocks`. All but the flood is zero before a pass.
  IST_HD static std::size_t fixed(std::uint32_t blocks) {
    const std::size_t words = (blocks + 31) / 32;
    return (4 * (3 * std::size_t{blocks} + 6 * words) + 255) / 256 * 256;
  }
  IST_HD static ExactWorkspace at(std::byte* from, std::uint32_t blocks, int pass) {
    ExactWorkspace work;
    work.words = (blocks + 31) / 32;
    auto* next = reinterpret_cast<std::uint32_t*>(from);
    const auto take = [&](std::uint32_t count) {
      std::uint32_t* const part = next;
      next += count;
      return part;
    };
    for (auto& record : work.record) record = take(blocks);
    for (auto& bits : work.near) bits = take(work.words);
    for (auto& bits : work.pierced) bits = take(work.words);
    for (auto& bits : work.inside) bits = take(work.words);
    work.flood = take(blocks);
    next = reinterpret_cast<std::uint32_t*>(from + fixed(blocks));
    auto bytes = static_cast<std::uint32_t>(exact_bytes(pass));
    if (pass > 0) {
      const std::uint32_t part = bytes / 8;  // an eighth for pending nodes, three for triangles
      work.most_waiting = part / 8;
      work.waiting = reinterpret_cast<std::uint64_t*>(take(part / 4));
      constexpr std::uint32_t kChunk = sizeof(ExactChunk);
      work.pool.capacity = 3 * part / (kChunk + 8);
      work.pool.chunks = reinterpret_cast<ExactChunk*>(take(work.pool.capacity * (kChunk / 4)));
      work.pool.next = take(work.pool.capacity);
      work.pool.taken = take(1);
      bytes -= 4 * part;
    }
    work.records = reinterpret_cast<CrossedRef*>(next);
    work.most_records = bytes / static_cast<std::uint32_t>(sizeof(CrossedRef));
    return work;
  }
};

/// A batch of pairs of assets with meshes, by Measure::exact.
struct ExactArrays : SolidPairs {
  ExactCounters* counters;
  std::uint32_t* list[kExactPasses];  ///< pairs of each pass; that of the first is a ring
  // The memory of a round, followed by that of its teams. The teams of later passes use all of it.
  std::byte* memory;
  std::size_t bytes;
  ExactQuery* queries;
  ExactPool pool;
  std::uint32_t query_capacity;
  std::byte* team_memory;
  std::uint32_t most_blocks;  ///< of any solid's mesh

  IST_HD std::size_t bytes_of_team(int pass) const {
    return ExactWorkspace::fixed(most_blocks) + exact_bytes(pass);
  }
  IST_HD ExactWorkspace workspace(int pass, std::uint32_t team) const {
    return ExactWorkspace::at((pass == 0 ? team_memory : memory) + team * bytes_of_team(pass),
                              most_blocks, pass);
  }
};

// Candidates that exact batches keep for each pair from call to call: all pairs of triangles that a
// search may find before B has moved by more than a margin.

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

// The working memory of contact patches by Measure::exact.

/// A team's memory that is handed out piece by piece. All lanes make the same calls.
struct Arena {
  std::byte* at;
  std::byte* end;

  /// Null if the rest is too small.
  template <class T>
  IST_HD T* take(std::size_t count) {
    constexpr std::size_t kAlign = 16;
    static_assert(alignof(T) <= kAlign);
    const std::size_t bytes = (count * sizeof(T) + kAlign - 1) / kAlign * kAlign;
    if (static_cast<std::size_t>(end - at) < bytes) return nullptr;
    T* const taken = reinterpret_cast<T*>(at);
    at += bytes;
    return taken;
  }
};

/// Teams also search, as in the later passes of penetrations.
constexpr int kFirstPatchPass = 0;
/// [bytes] of a team's memory for crossings and parts. A crossing takes about 1 KB.
IST_HD constexpr std::size_t patch_bytes(int pass) {
  return pass == 0 ? 384u << 10 : pass == 1 ? 2u << 20 : 16u << 20;
}

struct ExactPatchArrays : ExactArrays {
  GpuContactPatches patches;

  IST_HD std::size_t bytes_of_team(int pass) const {
    return searching(pass) + patch_bytes(pass) + 16 * std::size_t{most_blocks};
  }
  IST_HD std::byte* team(int pass, std::uint32_t n) const {
    return memory + n * bytes_of_team(pass);
  }
  IST_HD ExactWorkspace workspace(int pass, std::uint32_t n) const {
    return ExactWorkspace::at(team(pass, n), most_blocks, search_pass(pass));
  }
  IST_HD Arena arena(int pass, std::uint32_t n) const {
    return {team(pass, n) + searching(pass), team(pass, n + 1)};
  }

 private:
  /// The first two passes search in equal memory.
  IST_HD static int search_pass(int pass) { return pass == 0 ? 1 : pass; }
  IST_HD std::size_t searching(int pass) const {
    return ExactArrays::bytes_of_team(search_pass(pass));
  }
};

}  // namespace ist::gpu
