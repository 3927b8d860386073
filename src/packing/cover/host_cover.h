#pragma once

#include <functional>
#include <vector>

#include "mesh/mesh_solid.h"
#include "packing/backend/tasks.h"

namespace ist {

/// SolidBackend::cover_radii() on the threads of the current arena.
std::vector<double> cover_on_host(const MeshSolid& solid, const CoverTask& task,
                                  const std::function<void(int)>& report);

/// The same for a solid known by its signed distance alone, in the unit frame `frame`.
std::vector<double> cover_on_host(const Solid& solid, const UnitFrame& frame, const CoverTask& task,
                                  const std::function<void(int)>& report);

}  // namespace ist
