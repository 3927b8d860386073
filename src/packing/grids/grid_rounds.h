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

// The work of a grid packing's rounds is done by host threads (host_rounds.h) or a device
// (cuda/grids/device_grid_rounds.h). Both give the same winners and offer the same calls:
//
//   build(layout)             the distance grid of that layout, with all spheres so far
//   place_prototypes(layout)  the prototype grid of that layout
//   split_prototypes()        its cells split in 8
//   round(settings, go_on)    std::vector<GridWinner> in any order
//   converged(settings, go_on)  std::vector<GridCandidate>, all that converged, in any order
//   append(spheres)           they count after the next update() or build()
//   update()                  lists, active cells and discrete distances after append()
//   use()                     GridUse

}  // namespace ist::packing
