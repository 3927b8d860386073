#pragma once

#include <cstddef>
#include <cstdint>

#include "query/base/hooked_memory.h"
#include "query/base/relative_pose.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// The pairs of triangles of two solids that may cross, or be near, while no point of B has moved
/// by more than `margin` against A.
struct KeptPairs {
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};

  std::uint64_t mesh[2];    ///< hashes of the assets
  Similarity last;          ///< B in A at the last query
  double step;              ///< how far it had moved since the one before
  std::uint32_t crossings;  ///< that the last query found
  double steps;             ///< that the next margin is made for
  Similarity found_at;      ///< B in A when the pairs were found
  double margin;            ///< A's unit frame; 0: none are kept
  double room;              ///< of the search that found them
  double moved;             ///< since they were found; set by KeptRing::holds
  std::uint64_t first;      ///< in the ring
  std::uint32_t count;
  std::uint64_t nearest = kNone;  ///< of distances: the pair that the last query found
  double apart = 0;               ///< of distances: that of the last query, or less; 0: unknown
  double horizon = 0;  ///< of distances: what is not kept was no nearer when the pairs were found
  double gone = 0;     ///< of distances: how far B has gone since, step by step
  /// Of crossings that all hang together, and of what they go around: see ExactParts. 0: unknown.
  std::uint64_t one = 0;
};

/// Whether after a step so long, from a distance, what was near before still says much.
bool is_short(double step, const MeshTree& a, const MeshTree& b, double scale,
              double distance) noexcept;

/// What exact queries keep from call to call: pairs of triangles of many pairs of solids. The
/// oldest are overwritten.
class KeptRing {
 public:
  KeptRing(std::size_t capacity, const MemoryHooks& hooks);

  /// What is kept of the caller's pair `id`, for a query at `pose`.
  KeptPairs& of(std::uint32_t id, const MeshTree& a, const MeshTree& b,
                const Similarity& pose) noexcept;
  /// Whether its pairs are all that a search by `room` can find.
  bool serves(KeptPairs& kept, const MeshTree& b, double room) const noexcept;
  /// Whether what is kept is still there. Sets kept.moved.
  bool holds(KeptPairs& kept, const MeshTree& b) const noexcept;
  /// Empties the list and sets kept.margin, by which a search looks ahead while it adds pairs in
  /// their order. 0: keeping would not pay.
  void begin(KeptPairs& kept, const MeshTree& a, const MeshTree& b, double room) noexcept;
  std::uint64_t most() const noexcept { return mask_ + 1; }  ///< that one list may have
  /// There are too many: none are kept, and the next margin will be less.
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
  HookedArray<std::uint32_t> ids_;  ///< of the slots; 0: free
  HookedArray<KeptPairs> slots_;
};

}  // namespace ist
