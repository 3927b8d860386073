#pragma once

#include <functional>
#include <span>

#include <ist/sphere.h>

#include "mesh/mesh_solid.h"
#include "packing/backend/tasks.h"

// Calibration's heavy parts on the threads of the current arena; SolidBackend says what they do.

namespace ist {

RelaxedSites relax_on_host(const MeshSolid& solid, const RelaxTask& task,
                           const std::function<void(double)>& report);

double protrusion_on_host(const MeshSolid& solid, std::span<const Sphere> balls);

}  // namespace ist
