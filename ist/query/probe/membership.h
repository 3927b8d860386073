#pragma once

#include "query/asset/surface_tree.h"

namespace ist {

/// Whether a point of the surface's unit frame is inside it: from the reference point of its
/// cell, counting the steps through the cell's triangles. A point on the surface may be either.
/// `clear`: the surface is known to be no nearer to the point than this.
bool inside_surface(const SurfaceTree& surface, const double (&point)[3], double clear) noexcept;

}  // namespace ist
