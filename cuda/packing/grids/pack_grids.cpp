#include "cuda/packing/grids/pack_grids.h"

#include "cuda/packing/grids/device_rounds.h"

namespace ist::gpu {

SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage) {
  std::size_t free_bytes = 0, total_bytes = 0;
  check(cudaMemGetInfo(&free_bytes, &total_bytes), "querying the free memory");
  // Half of the memory is for prototypes and other data on the device.
  SpherePacking result = packing::pack_grids_by(DeviceRounds(queue, solid.arrays()), solid,
                                                settings, free_bytes / 2, stage);
  queue.wait();
  return result;
}

std::vector<MedialNode> medial_nodes(Queue& queue, const MeshSolid& solid,
                                     const MedialSettings& settings) {
  return packing::medial_nodes_by(DeviceRounds(queue, solid.arrays()), solid, settings);
}

}  // namespace ist::gpu
