#pragma once

#include <span>

#include <ist/sphere.h>
#include "cuda/queue.h"
#include "mesh/wide_tree.h"

namespace ist::gpu {

/// How far any of the balls sticks out of the solid at most, at least 0; unit frame, as on the
/// host.
double largest_protrusion(Queue& queue, const WideTree& mesh, std::span<const Sphere> balls);

}  // namespace ist::gpu
