#pragma once

#include <functional>
#include <vector>

#include "backend/tasks.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// SolidBackend::cover_radii() on the threads of the current arena.
std::vector<double> cover_on_host(const MeshSolid& solid, const CoverTask& task,
                                  const std::function<void(int)>& report);

}  // namespace ist
