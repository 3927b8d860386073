#pragma once

#include <functional>

#include "packing/grids/ascent.h"

namespace ist::packing {

/// A candidate that no larger one overlaps, and the radius it may keep, in double.
struct GridWinner {
  GridCandidate candidate;
  double room = 0;
};

/// Called between pieces of a round's work; false: give up.
using GoOn = std::function<bool()>;

// The work of a grid packing's rounds is done by host threads (host_rounds.h) or a device
// (cuda/packing/grids/device_rounds.h). Both give the same winners and offer the same calls:
//
//   build(layout)             the distance grid of that layout, with all spheres so far
//   place_prototypes(layout)  the prototype grid of that layout
//   split_prototypes()        its cells split in 8
//   round(settings, go_on)    std::vector<GridWinner> in any order
//   converged(settings, go_on)  std::vector<GridCandidate>, all that converged, in any order
//   append(spheres)           they count after the next update() or build()
//   update()                  lists, active cells and discrete distances after append()

}  // namespace ist::packing
