#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/query/batch_arrays.h"
#include "query/exact/inside_search.h"

// Where the exact overlaps of a batch are worked out.

namespace ist::gpu {

/// A batch is asked in passes: in rounds, by as many teams as the device runs; what has no room
/// there with more memory, by fewer; and what needs still more, by few.
constexpr int kExactPasses = 3;
/// [bytes] of a team's room beside what the largest mesh takes.
IST_HD constexpr std::size_t exact_room(int pass) {
  return pass == 0 ? 80u << 10 : pass == 1 ? 512u << 10 : 16u << 20;
}

/// How the work on a pair stands.
enum class ExactState : std::uint32_t {
  ok,
  nothing,  ///< answered, but the volume may be nothing: do they touch?
  unsure,   ///< doubles do not tell
  no_room,  ///< more than the team's memory holds
  later,    ///< others have left no room in this round
  wrong,    ///< signs contradict each other
};

/// A round of the first pass takes pairs through its steps, of which each is a small kernel: they
/// are placed, searched for triangles that may cross, summed by signs in doubles, and where these
/// do not tell by exact ones; where there is no volume they are searched for faces that touch. The
/// next round begins where the room for triangles has come to its end.
struct ExactRound {
  std::uint32_t first, count;                       ///< of the pairs listed
  std::uint32_t searched, summed, redone, touched;  ///< of them taken
  std::uint32_t found;                              ///< of them, searches that are done
  std::uint32_t unsure, nothing;                    ///< of them
  std::uint32_t chunks;                             ///< taken
};

/// Zero at first.
struct ExactCounters {
  std::uint32_t listed[kExactPasses];  ///< pairs that a pass asks
  std::uint32_t taken[kExactPasses];
  ExactRound round[2];    ///< in turn
  std::uint32_t exactly;  ///< pairs summed by exact signs
};

/// Pairs of triangles, 16 · block + lane, in the order in which they were found: a chain of chunks.
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
  std::uint32_t room;
};

/// What the steps of a pair begin with, made by one thread.
struct ExactFrame {
  PairPlace place;
  exact::Point aside;
  double moved[2];  ///< no point of a surface is further from where it ought to be
  double touch;     ///< what comes as near touches
  float reach[2];   ///< boxes that are as near are opened: A's frame, B's
  float pad[2];     ///< what rounding does to boxes of A in B's frame, of B in A's
  float slack;      ///< and to slabs
};

/// What the sums of a pair leave to be asked: A's unit frame.
struct ExactLeft {
  double volume, error;
  double push;  ///< no less than the force's length
};

/// A pair of a round: what its steps hand on.
struct ExactQuery {
  ExactFrame frame;
  std::uint32_t pair;  ///< of the batch
  ExactState state;
  std::uint32_t visits;
  ExactChain crossing, near;  ///< triangles that may cross; others whose signs are not settled
  std::uint32_t unsure;       ///< in the k-th query the k-th of the round that doubles do not tell
  std::uint32_t nothing;      ///< likewise the k-th that may have no volume
  ExactLeft left;             ///< of such a one
};

/// A block of which triangles cross others.
struct CrossedRef {
  std::uint32_t block;
  std::uint16_t inside;  ///< a bit a local vertex
  std::uint16_t of_b;
  std::uint32_t pierced[2];  ///< bit 3 · lane + edge, in two words
  /// Of an edge, how often it enters more than it leaves: in all · 2^16, plus at places that are
  /// nearer to its first corner. Modulo 2^32, so that lanes may add in any order.
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
struct ExactRoom {
  std::uint32_t* record[2];   ///< [blocks] of a block of A, of B: its record + 1; 0: none
  std::uint32_t* near[2];     ///< a bit a block: signs of it might differ if points moved
  std::uint32_t* pierced[2];  ///< a bit a block: edges of it are pierced
  std::uint32_t* inside[2];   ///< a bit a block: no edge is pierced, and it lies inside
  std::uint32_t* flood;       ///< [blocks]
  CrossedRef* records;
  std::uint32_t most_records;
  std::uint32_t words;  ///< of a bit a block
  // What a team that also searches takes.
  std::uint64_t* waiting;  ///< pairs of nodes: level and number of A's, then of B's
  std::uint32_t most_waiting;
  ExactPool pool;

  /// What the largest mesh takes, of `blocks`: all but the flood is zero before a pass.
  IST_HD static std::size_t fixed(std::uint32_t blocks) {
    const std::size_t words = (blocks + 31) / 32;
    return (4 * (3 * std::size_t{blocks} + 6 * words) + 255) / 256 * 256;
  }
  IST_HD static ExactRoom at(std::byte* from, std::uint32_t blocks, int pass) {
    ExactRoom room;
    room.words = (blocks + 31) / 32;
    auto* next = reinterpret_cast<std::uint32_t*>(from);
    const auto take = [&](std::uint32_t count) {
      std::uint32_t* const part = next;
      next += count;
      return part;
    };
    for (auto& record : room.record) record = take(blocks);
    for (auto& bits : room.near) bits = take(room.words);
    for (auto& bits : room.pierced) bits = take(room.words);
    for (auto& bits : room.inside) bits = take(room.words);
    room.flood = take(blocks);
    next = reinterpret_cast<std::uint32_t*>(from + fixed(blocks));
    auto bytes = static_cast<std::uint32_t>(exact_room(pass));
    if (pass > 0) {
      const std::uint32_t part = bytes / 8;  // of the nodes that wait; three of the triangles
      room.most_waiting = part / 8;
      room.waiting = reinterpret_cast<std::uint64_t*>(take(part / 4));
      constexpr std::uint32_t kChunk = sizeof(ExactChunk);
      room.pool.room = 3 * part / (kChunk + 8);
      room.pool.chunks = reinterpret_cast<ExactChunk*>(take(room.pool.room * (kChunk / 4)));
      room.pool.next = take(room.pool.room);
      room.pool.taken = take(1);
      bytes -= 4 * part;
    }
    room.records = reinterpret_cast<CrossedRef*>(next);
    room.most_records = bytes / static_cast<std::uint32_t>(sizeof(CrossedRef));
    return room;
  }
};

/// Its pairs of assets that keep their meshes, by Measure::exact.
struct ExactArrays : SolidPairs {
  ExactCounters* counters;
  std::uint32_t* list[kExactPasses];  ///< pairs that a pass asks; the first's goes round
  // A round's, then the teams'; the later passes' teams have all of it.
  std::byte* memory;
  std::size_t bytes;
  ExactQuery* queries;
  ExactPool pool;
  std::uint32_t query_room;
  std::byte* rooms;
  std::uint32_t most_blocks;  ///< of a solid's mesh

  IST_HD std::size_t bytes_of_team(int pass) const {
    return ExactRoom::fixed(most_blocks) + exact_room(pass);
  }
  IST_HD ExactRoom room(int pass, std::uint32_t team) const {
    return ExactRoom::at((pass == 0 ? rooms : memory) + team * bytes_of_team(pass), most_blocks,
                         pass);
  }
};

}  // namespace ist::gpu
