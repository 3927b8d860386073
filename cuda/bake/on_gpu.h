#pragma once

#include <ist/sphere.h>

#include <functional>
#include <span>
#include <vector>

#include "cuda/bake/columns_on_gpu.h"
#include "cuda/queue.h"
#include "mesh/wide_tree.h"
#include "packing/backend/tasks.h"

namespace ist::gpu {

/// The cover radii before rounding to float, bit for bit those of the host. `report(depth)` is
/// called before each level.
std::vector<double> cover_radii(Queue& queue, const WideTree& mesh, const CoverTask& task,
                                const std::function<void(int)>& report);

/// How far any of the balls sticks out of the solid at most, at least 0; unit frame, as on the
/// host.
double largest_protrusion(Queue& queue, const WideTree& mesh, std::span<const Sphere> balls);

/// Relaxes sites within a solid's columns, bit for bit as on the host. `report(part)` is called
/// with the part that is done, [0, 1]. Returns none if the columns cannot measure the solid.
RelaxedSites relax_sites(Queue& queue, const WideTree& mesh, const RelaxTask& task,
                         const std::function<void(double)>& report);

}  // namespace ist::gpu
