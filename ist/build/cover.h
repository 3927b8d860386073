#pragma once

#include <span>
#include <vector>

#include <ist/packing.h>
#include <ist/progress.h>

#include "mesh/mesh_solid.h"

namespace ist::gpu {
class MeshOnGpu;
}

namespace ist {

/// Cover radii of a packing (DESIGN 5), unit frame, rounded up: c_i ≥ r_i, and every point of the
/// solid is within c_i of the centre of some inner sphere i. Proven by subdivision: a cell is left
/// out only where its middle is further outside than its corners reach, or where one ball holds all
/// of it. Balls are enlarged for points of the solid found on the way, level by level, so that few
/// cells come down to the smallest size. Same bytes for any number of threads (0 = all cores) and
/// on the GPU, which does it if `gpu`, where the solid lies, is not null. Throws Error if there are
/// no spheres or progress cancels.
std::vector<float> cover_radii(const MeshSolid& solid, std::span<const Sphere> inner,
                               unsigned threads, const ProgressCallback& progress,
                               gpu::MeshOnGpu* gpu = nullptr);

}  // namespace ist
