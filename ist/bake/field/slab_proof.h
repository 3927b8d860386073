#pragma once

#include <array>
#include <span>

#include "mesh/mesh_view.h"

namespace ist {

/// Shows that every point of a hull lies within `distance` of a closed surface: moved by it along
/// `direction` and against it, the hull does not meet the surface, and the winding number is not
/// the same; so the surface passes between. False: it may be so or not. Unit frame.
///
/// `surface` has a hierarchy; `direction` is of unit length, but for rounding.
bool within_slab(const MeshView& surface, std::span<const std::array<double, 3>> hull,
                 const double direction[3], double distance);

}  // namespace ist
