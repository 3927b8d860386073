#pragma once

#include <cstdint>

#include "base/vec3.h"

namespace ist::packing {

/// A cube of the octree over the unit frame, and its bounds. Its prototype is the point that the
/// ascent from it reached, which may lie outside the cube. Work on a cell depends on this and its
/// ring alone, never on where either is stored.
struct Cell {
  Float3 centre;
  float half = 1;              ///< half-edge
  float bound = 2;             ///< upper bound of the radius of any sphere centred in the cube
  float surface_at_least = 0;  ///< lower bound of the centre's distance to the surface
  std::uint32_t seen = 0;      ///< count of spheres when bound and prototype were last computed
  Float3 prototype;
  float radius = 0;        ///< clearance of the prototype; 0: none
  bool inside = false;     ///< the centre lies in the solid
  bool side_known = true;  ///< `inside` was computed for this centre, not inherited from the parent
  std::uint8_t ring_size = 0;  ///< features in the ring
  std::uint8_t ring_next = 0;  ///< index of the next entry
};

/// The last few surface features that were closest somewhere near a cell. Children inherit their
/// parent's. Each gives a constraint without a search; a new one replaces the oldest.
constexpr int kRingCapacity = 8;

template <class Feature>
struct StoredCell {
  Cell cell;
  Feature ring[kRingCapacity];
};

/// The k-th of the eight children of a cell, with the bounds that its parent's imply.
IST_HD inline Cell octant(const Cell& parent, int k) {
  const float quarter = 0.5f * parent.half;
  Cell child;
  child.centre = {parent.centre.x + ((k & 1) != 0 ? quarter : -quarter),
                  parent.centre.y + ((k & 2) != 0 ? quarter : -quarter),
                  parent.centre.z + ((k & 4) != 0 ? quarter : -quarter)};
  child.half = quarter;
  child.bound = parent.bound;
  child.surface_at_least = parent.surface_at_least - quarter * 1.7320510f;
  child.inside = parent.inside;
  child.side_known = child.surface_at_least > 0;
  child.ring_size = parent.ring_size;
  child.ring_next = parent.ring_next;
  return child;
}

}  // namespace ist::packing
