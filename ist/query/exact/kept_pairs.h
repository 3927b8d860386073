#pragma once

#include <cstddef>
#include <cstdint>

#include "query/base/hooked_memory.h"
#include "query/base/relative_pose.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// The pairs of triangles of two solids that may cross or be near as long as no point of B has
/// moved by more than `margin` relative to A.
struct KeptPairs {
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};

  std::uint64_t mesh[2];    ///< hashes of the assets
  Similarity last;          ///< B in A at the last query
  double step;              ///< the motion since the query before
  std::uint32_t crossings;  ///< found by the last query
  double steps;             ///< the number of steps that the next margin allows for
  Similarity found_at;      ///< B in A when the pairs were found
  double margin;            ///< A's unit frame; 0: none are kept
  double tolerance;         ///< the tolerance of the search that found them
  double moved;             ///< since they were found; set by KeptRing::holds
  std::uint64_t first;      ///< in the ring
  std::uint32_t count;
  std::uint64_t nearest = kNone;  ///< for distances: the pair that the last query found
  double apart = 0;  ///< for distances: a lower bound of the last query's; 0 if unknown
  double horizon =
      0;  ///< for distances: a lower bound for pairs that are not kept, when the list was made
  double gone = 0;  ///< for distances: the length of B's path since, step by step
  /// A hash of crossings that are all connected, and of what they surround (ExactParts); 0 if
  /// unknown.
  std::uint64_t one = 0;
};

/// True if what was near before a step of that length, at a distance, is still informative.
bool is_short(double step, const MeshTree& a, const MeshTree& b, double scale,
              double distance) noexcept;

/// The pairs of triangles that exact queries keep from call to call, for many pairs of solids. The
/// oldest are overwritten.
class KeptRing {
 public:
  KeptRing(std::size_t capacity, const MemoryHooks& hooks);

  /// The kept pairs of the caller's pair `id`, for a query at `pose`.
  KeptPairs& of(std::uint32_t id, const MeshTree& a, const MeshTree& b,
                const Similarity& pose) noexcept;
  /// True if its pairs are all that a search with tolerance `tolerance` can find.
  bool serves(KeptPairs& kept, const MeshTree& b, double tolerance) const noexcept;
  /// True if the list is still in the ring. Sets kept.moved.
  bool holds(KeptPairs& kept, const MeshTree& b) const noexcept;
  /// Empties the list and sets kept.margin, by which a search looks ahead while it adds pairs in
  /// order. 0 if keeping does not pay.
  void begin(KeptPairs& kept, const MeshTree& a, const MeshTree& b, double tolerance) noexcept;
  std::uint64_t most() const noexcept { return mask_ + 1; }  ///< the most that one list may have
  /// Drops a list with too many pairs. The next margin will be smaller.
  static void give_up(KeptPairs& kept) noexcept;
  void add(KeptPairs& kept, std::uint64_t pair) noexcept {
    ring_[static_cast<std::size_t>(written_++ & mask_)] = pair;
    ++kept.count;
  }
  std::uint64_t& pair(const KeptPairs& kept, std::uint32_t i) noexcept {
    return ring_[static_cast<std::size_t>((kept.first + i) & mask_)];
  }

 private:
  static constexpr std::uint32_t kSlots = 1024;

  std::uint64_t mask_, written_ = 0;
  HookedArray<std::uint64_t> ring_;
  HookedArray<std::uint32_t> ids_;  ///< of the slots; 0 if free
  HookedArray<KeptPairs> slots_;
};

}  // namespace ist
