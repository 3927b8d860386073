#include "cuda/grids/device_grid_rounds.h"

namespace ist::gpu {

std::vector<packing::GridWinner> DeviceGridRounds::round(const packing::AscentSettings& settings,
                                                         const packing::GoOn& go_on) {
  const packing::GridScene scene = grid_.scene();
  if (!prototypes_.converge(scene, settings, go_on)) return {};
  return prototypes_.winners(scene);
}

std::vector<packing::GridCandidate> DeviceGridRounds::converged(
    const packing::AscentSettings& settings, const packing::GoOn& go_on) {
  if (!prototypes_.converge(grid_.scene(), settings, go_on)) return {};
  return prototypes_.candidates();
}

void DeviceGridRounds::append(const std::vector<Sphere>& spheres) {
  grid_.append(spheres.data(), spheres.size());
  queue_.wait();  // the vector is the caller's
}

SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage) {
  std::size_t free_bytes = 0, total_bytes = 0;
  check(cudaMemGetInfo(&free_bytes, &total_bytes), "querying the free memory");
  // Half of it is for prototypes and what else lives on the device.
  SpherePacking result = packing::pack_grids_by(DeviceGridRounds(queue, solid.arrays()), solid,
                                                settings, free_bytes / 2, stage);
  queue.wait();
  return result;
}

}  // namespace ist::gpu
