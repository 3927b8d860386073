#pragma once

#include <span>

#include "mesh/wide_tree.h"
#include "query/asset_layout.h"
#include "queue.h"

namespace ist::gpu {

/// How far any of the balls sticks out of the solid at most, at least 0; unit frame, as on the
/// host.
double largest_protrusion(Queue& queue, const WideTree& mesh, std::span<const Sphere4> balls);

}  // namespace ist::gpu
