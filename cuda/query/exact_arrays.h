#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/query/batch_arrays.h"
#include "query/exact/inside_search.h"

// The working memory of exact overlaps of a batch.

namespace ist::gpu {

/// The passes of a batch. The first works in rounds, with as many teams as the device runs. Pairs
/// that need more memory go to the later passes, which have fewer teams with more memory each.
constexpr int kExactPasses = 3;
/// [bytes] of a team's memory beside that for the largest mesh.
IST_HD constexpr std::size_t exact_bytes(int pass) {
  return pass == 0 ? 80u << 10 : pass == 1 ? 512u << 10 : 16u << 20;
}

/// The state of a pair.
enum class ExactState : std::uint32_t {
  ok,
  nothing,        ///< answered, but the volume may be 0: do the solids touch?
  unsure,         ///< doubles do not decide
  out_of_memory,  ///< the team's memory does not suffice
  later,          ///< the round's memory is used up
  wrong,          ///< signs contradict each other
};

/// A round of the first pass. Its steps are small kernels: they place pairs, search for triangles
/// that may cross, sum by signs in doubles and, where these do not decide, by exact signs. Pairs
/// without volume are searched for faces that touch. A round ends when the memory for triangles is
/// used up.
struct ExactRound {
  std::uint32_t first, count;                       ///< of the listed pairs
  std::uint32_t searched, summed, redone, touched;  ///< of these pairs, taken so far
  std::uint32_t found;                              ///< finished searches
  std::uint32_t unsure, nothing;                    ///< of them
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
/// holds those of one pair of solids.
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
  double touch;     ///< solids that are as near touch
  float reach[2];   ///< boxes that are as near are opened, in A's frame and in B's
  float pad[2];     ///< rounding of A's boxes in B's frame, and of B's in A's
  float slack;      ///< rounding of slabs
};

/// The parts of a pair's sums that decide whether the solids touch, A's unit frame.
struct ExactLeft {
  double volume, error;  ///< the volume below 0 by rounding alone
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
  /// For each edge, entries less exits: 2^16 times their total, plus those nearer to its first
  /// corner. Modulo 2^32, so that lanes may add in any order.
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

}  // namespace ist::gpu
