#pragma once

#include <ist/api.h>

namespace IST_API ist {

/// A sphere in the unit frame of its solid (half-extent of the solid in (½, 1]).
struct Sphere {
  float x = 0, y = 0, z = 0;  ///< centre, unit frame
  float r = 0;                ///< radius, unit frame; rounded down for an inner sphere
};

}  // namespace ist
