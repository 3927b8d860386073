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

packing::GridUse DeviceGridRounds::use() const {
  packing::GridUse u;
  u.cells = grid_.layout().count();
  u.active_cells = grid_.active_cells();
  u.prototypes = prototypes_.count();
  u.bytes = grid_.bytes() + prototypes_.count() * packing::kPrototypeBytes;
  u.dense_bytes =
      packing::dense_grid_bytes(u.cells, prototypes_.layout().count(), grid_.list_bytes());
  u.hashed = grid_.hashed();
  return u;
}

SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage, std::vector<packing::GridRound>* history) {
  std::size_t free_bytes = 0, total_bytes = 0;
  check(cudaMemGetInfo(&free_bytes, &total_bytes), "querying the free memory");
  // Half of it is for prototypes and what else lives on the device.
  const packing::GridSchedule schedule = packing::grid_schedule(
      settings.grid, settings.grids, packing::grid_figures(solid, free_bytes / 2));
  const packing::PackingLimits limits =
      packing::packing_limits(solid, solid.frame().scale(), settings);
  DeviceGridRounds rounds(queue, solid.arrays());
  SpherePacking result = packing::GridPacker(rounds, schedule, limits, stage, history).run();
  queue.wait();
  return result;
}

}  // namespace ist::gpu
