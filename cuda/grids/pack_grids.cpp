#include "grids/pack_grids.h"

#include <algorithm>

#include "grids/device_rounds.h"

namespace ist::gpu {
namespace {

class DeviceBackend final : public packing::GridBackend {
 public:
  DeviceBackend(Queue& queue, const MeshView& mesh)
      : queue_(queue), grid_(queue, mesh), prototypes_(queue) {}

  void build(const packing::GridLayout& layout) override { grid_.build(layout); }
  void place_prototypes(const packing::GridLayout& layout) override { prototypes_.place(layout); }
  void split_prototypes() override { prototypes_.split(); }

  std::vector<packing::GridWinner> round(const packing::AscentSettings& settings,
                                         const packing::GoOn& go_on) override {
    const packing::GridScene scene = grid_.scene();
    if (!prototypes_.converge(scene, settings, go_on)) return {};
    return prototypes_.winners(scene);
  }

  std::vector<packing::GridCandidate> converged(const packing::AscentSettings& settings,
                                                const packing::GoOn& go_on) override {
    if (!prototypes_.converge(grid_.scene(), settings, go_on)) return {};
    return prototypes_.candidates();
  }

  void append(const std::vector<Sphere>& spheres) override {
    grid_.append(spheres.data(), spheres.size());
    queue_.wait();  // the vector is the caller's
  }
  void update() override { grid_.update(); }

  packing::GridUse use() const override {
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

 private:
  Queue& queue_;
  DeviceGrid grid_;
  DevicePrototypes prototypes_;
};

}  // namespace

std::unique_ptr<packing::GridBackend> make_grid_backend(Queue& queue, const MeshView& mesh) {
  return std::make_unique<DeviceBackend>(queue, mesh);
}

SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         const ProgressCallback& progress,
                         std::vector<packing::GridRound>* history) {
  std::size_t free_bytes = 0, total_bytes = 0;
  check(cudaMemGetInfo(&free_bytes, &total_bytes), "asking for the free memory");
  // Half of it is for prototypes and what else lives on the device.
  const packing::GridSchedule schedule = packing::grid_schedule(
      settings.grid, settings.grids, packing::grid_figures(solid, free_bytes / 2));
  const auto backend = make_grid_backend(queue, solid.arrays());
  SpherePacking result = packing::pack_on_grids(
      *backend, schedule, packing::grid_limits(solid, settings), settings, progress, history);
  queue.wait();
  return result;
}

}  // namespace ist::gpu
