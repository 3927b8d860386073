#include "grids/medial_on_gpu.h"

#include <ist/error.h>

#include "grids/pack_grids.h"
#include "queue.h"

namespace ist::gpu {

std::vector<packing::GridCandidate> converged_on_gpu(const MeshView& mesh,
                                                     const packing::GridLayout& distances,
                                                     const packing::AscentSettings& settings,
                                                     const GpuSettings& gpu) {
  gpu_info(gpu.device);  // throws where there is none
  Queue queue(gpu);
  const auto backend = make_grid_backend(queue, mesh);
  backend->build(distances);
  backend->place_prototypes(settings.layout);
  return backend->converged(settings, [] { return true; });
}

}  // namespace ist::gpu
