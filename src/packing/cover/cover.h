#pragma once

#include <ist/types.h>

#include "mesh/mesh_solid.h"
#include "packing/backend/solid_backend.h"
#include "packing/backend/tasks.h"

namespace ist {

/// Cover radii of a packing (docs/design.md 5), unit frame, rounded up: c_i ≥ r_i, and every point
/// of the solid is within c_i of the centre of some inner sphere i. Subdivision proves it: a cell
/// is dropped only if its middle is further outside than its corners reach, or if one ball contains
/// all of it. Balls are enlarged level by level for points of the solid that are found, so that few
/// cells reach the smallest size. `backend`: the solid's. Same bytes for any backend and number of
/// threads (the arena's). Throws Error without spheres or if progress cancels.
std::vector<float> cover_radii(const MeshSolid& solid, SolidBackend& backend,
                               std::span<const Sphere> inner, const ProgressCallback& progress);

/// SolidBackend::cover_radii() on the threads of the current arena.
std::vector<double> cover_on_host(const MeshSolid& solid, const CoverTask& task,
                                  const std::function<void(int)>& report);

/// The same for a solid with only a signed distance, in the unit frame `frame`.
std::vector<double> cover_on_host(const Solid& solid, const UnitFrame& frame, const CoverTask& task,
                                  const std::function<void(int)>& report);

}  // namespace ist
