#pragma once

#include <span>
#include <vector>

#include <ist/packing.h>
#include <ist/progress.h>

#include "mesh/mesh_solid.h"
#include "query/asset_layout.h"

namespace ist::gpu {
class MeshOnGpu;
}

namespace ist {

/// The effective spheres of a solid: one ball for each cell of a partition of the solid, with the
/// cell's volume and centre of mass (DESIGN 5).
struct Calibration {
  /// Unit frame, one for each inner sphere and in their order. Σ 4/3 π r³ is the solid's volume
  /// within 1e-6; every radius is > 0.
  std::vector<Sphere4> effective;
  /// Unit frame, proven: no effective sphere sticks further out of the solid than this.
  double protrusion = 0;
};

/// Calibrates a packing: relaxed power cells seeded by the inner spheres, integrated over columns
/// of the solid. Same bytes for any number of threads (0 = all cores) and on the GPU, which does it
/// if `gpu`, where the solid lies, is not null. Throws Error if there are no spheres or progress
/// cancels.
Calibration calibrate(const MeshSolid& solid, std::span<const Sphere> inner, unsigned threads,
                      const ProgressCallback& progress, gpu::MeshOnGpu* gpu = nullptr);

/// The same for several prefixes of the spheres, each of `counts` by itself: what is made of the
/// solid is shared.
std::vector<Calibration> calibrate_prefixes(const MeshSolid& solid, std::span<const Sphere> inner,
                                            std::span<const std::size_t> counts, unsigned threads,
                                            const ProgressCallback& progress,
                                            gpu::MeshOnGpu* gpu = nullptr);

}  // namespace ist
