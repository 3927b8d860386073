#pragma once

#include <ist/solid.h>

namespace ist {

struct IntegratedVolume {
  double value = 0;  ///< [u³]
  double error = 0;  ///< [u³]
};

/// Volume of a solid of which only a signed distance is known. Cells of an octree that the distance
/// decides count whole or not at all, the rest by how deep their centres lie. The error falls about
/// fourfold a level; the stated one is the larger of twice the last level's change and the change
/// of the level before, plus what chance may hide there. An estimate with room, not a proof.
IntegratedVolume integrate_volume(const Solid& solid);

}  // namespace ist
