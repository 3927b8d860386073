#pragma once

#include <ist/packing.h>

#include "packing/sphere_grid.h"

namespace ist::packing {

/// Gap that a certified sphere keeps to the surface and to other spheres, unit frame (DESIGN 3.2).
constexpr double kClearance = 1e-12;

/// Largest float not above x.
float rounded_down(double x);

/// The largest radius that {centre, radius} may keep next to the spheres of the grid, in double,
/// rounded down; ≤ 0 if none. `surface_distance`: exact, positive inside. The grid's reach must not
/// be less than `radius`.
float certified_radius(Float3 centre, float radius, double surface_distance,
                       const std::vector<Sphere>& spheres, const SphereGrid& grid);

}  // namespace ist::packing
