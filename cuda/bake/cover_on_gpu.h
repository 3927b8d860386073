#pragma once

#include <functional>
#include <vector>

#include "cuda/queue.h"
#include "mesh/wide_tree.h"
#include "packing/backend/tasks.h"

namespace ist::gpu {

/// The cover radii before rounding to float, bit for bit those of the host. `report(depth)` is
/// called before each level.
std::vector<double> cover_radii(Queue& queue, const WideTree& mesh, const CoverTask& task,
                                const std::function<void(int)>& report);

}  // namespace ist::gpu
