#pragma once

#include <ist/gpu.h>

#include <vector>

#include "mesh/mesh_view.h"
#include "packing/grids/ascent.h"

namespace ist::gpu {

/// All prototypes of a round without spheres, in any order. `distances`: layout of the distance
/// grid. Throws Error if the GPU cannot be used.
std::vector<packing::GridCandidate> converged_on_gpu(const MeshView& mesh,
                                                     const packing::GridLayout& distances,
                                                     const packing::AscentSettings& settings,
                                                     const GpuSettings& gpu);

}  // namespace ist::gpu
