#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/query/batch_arrays.h"
#include "query/exact/inside_search.h"

// Where the exact overlaps of a batch are worked out.

namespace ist::gpu {

/// A batch is asked in passes: in doubles and little memory, by as many teams as the device runs;
/// what that leaves undecided with exact signs and more memory; and what needs still more, by few.
constexpr int kExactPasses = 3;
/// [bytes] of a team's room beside what the largest mesh takes.
IST_HD constexpr std::size_t exact_room(int pass) {
  return pass == 0 ? 24u << 10 : pass == 1 ? 96u << 10 : 16u << 20;
}

/// Zero at first.
struct ExactCounters {
  std::uint32_t listed[kExactPasses];  ///< pairs that a pass asks
  std::uint32_t taken[kExactPasses];
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
  std::uint64_t* waiting;     ///< pairs of nodes: level and number of A's, then of B's
  std::uint64_t* pairs;       ///< of blocks, likewise
  CrossedRef* records;
  std::uint32_t most_waiting, most_pairs, most_records;
  std::uint32_t words;  ///< of a bit a block

  /// What the largest mesh takes, of `blocks`: zero before a pass.
  IST_HD static std::size_t fixed(std::uint32_t blocks) {
    const std::size_t words = (blocks + 31) / 32;
    return (4 * (3 * std::size_t{blocks} + 6 * words) + 255) / 256 * 256;
  }
  IST_HD static ExactRoom at(std::byte* from, std::uint32_t blocks, std::size_t bytes) {
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
    std::byte* const rest = from + fixed(blocks);
    room.most_waiting = static_cast<std::uint32_t>(bytes / 6 / sizeof(std::uint64_t));
    room.most_pairs = 2 * kWidth * kWidth;
    room.waiting = reinterpret_cast<std::uint64_t*>(rest);
    room.pairs = room.waiting + room.most_waiting;
    room.records = reinterpret_cast<CrossedRef*>(room.pairs + room.most_pairs);
    room.most_records = static_cast<std::uint32_t>(
        (bytes - 8 * (std::size_t{room.most_waiting} + room.most_pairs)) / sizeof(CrossedRef));
    return room;
  }
};

/// Its pairs of assets that keep their meshes, by Measure::exact.
struct ExactArrays : SolidPairs {
  ExactCounters* counters;
  /// Pairs that passes ask: the last asks from the first's list again.
  std::uint32_t* list[2];
  std::byte* rooms;
  std::size_t room_bytes;     ///< of all teams together
  std::uint32_t most_blocks;  ///< of a solid's mesh

  IST_HD std::size_t bytes_of_team(int pass) const {
    return ExactRoom::fixed(most_blocks) + exact_room(pass);
  }
  IST_HD ExactRoom room(int pass, std::uint32_t team) const {
    return ExactRoom::at(rooms + team * bytes_of_team(pass), most_blocks, exact_room(pass));
  }
};

}  // namespace ist::gpu
