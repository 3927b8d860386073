#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "packing/grids/ascent.h"

namespace ist::packing {

/// A candidate that no larger one overlaps, and the radius it may keep, in double.
struct GridWinner {
  GridCandidate candidate;
  double room = 0;
};

/// What the grids hold at a time.
struct GridUse {
  std::size_t cells = 0;         ///< of the distance grid
  std::size_t active_cells = 0;  ///< of these
  std::size_t prototypes = 0;    ///< placed in the last round
  std::size_t bytes = 0;         ///< of both grids: words or hash table, records, lists, prototypes
  std::size_t dense_bytes = 0;   ///< of the same with a record and a prototype for every cell
  bool hashed = false;           ///< the distance grid stands in a hash table
};

/// Of a prototype: its cell's id and its candidate.
constexpr std::size_t kPrototypeBytes = sizeof(std::uint32_t) + sizeof(GridCandidate);

/// What dense grids would hold: a record with a word for each cell, a prototype for each cell of
/// the prototype grid, and the same lists.
inline std::size_t dense_grid_bytes(std::size_t cells, std::size_t prototype_cells,
                                    std::size_t list_bytes) {
  return cells * (sizeof(CellRecord) + sizeof(std::uint32_t)) + prototype_cells * kPrototypeBytes +
         list_bytes;
}

/// Called between pieces of a round's work; false: give up.
using GoOn = std::function<bool()>;

/// Where the work of the rounds is done: the host's threads or a device. Both give the same
/// winners.
class GridBackend {
 public:
  virtual ~GridBackend() = default;

  /// The distance grid of that layout, with all spheres so far.
  virtual void build(const GridLayout& layout) = 0;
  /// The prototype grid of that layout, and later its cells split in 8.
  virtual void place_prototypes(const GridLayout& layout) = 0;
  virtual void split_prototypes() = 0;

  /// The winners of a round, in any order.
  virtual std::vector<GridWinner> round(const AscentSettings& settings, const GoOn& go_on) = 0;
  /// All that converged, in any order.
  virtual std::vector<GridCandidate> converged(const AscentSettings& settings,
                                               const GoOn& go_on) = 0;

  /// Appends spheres. They count after the next update() or build().
  virtual void append(const std::vector<Sphere>& spheres) = 0;
  /// Lists, active cells and discrete distances after append().
  virtual void update() = 0;

  virtual GridUse use() const = 0;
};

}  // namespace ist::packing
