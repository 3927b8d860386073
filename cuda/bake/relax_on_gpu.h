#pragma once

#include <functional>
#include <span>

#include "cuda/bake/columns_on_gpu.h"
#include "packing/backend/tasks.h"

namespace ist::gpu {

/// Relaxes sites within a solid's columns, bit for bit as on the host. `report(part)` is called
/// with the part that is done, [0, 1]. Returns none if the columns cannot measure the solid.
RelaxedSites relax_sites(Queue& queue, const WideTree& mesh, const RelaxTask& task,
                         const std::function<void(double)>& report);

}  // namespace ist::gpu
