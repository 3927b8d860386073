#include "cuda/packing/cuda_backend.h"

#include <optional>

#include "base/stage.h"
#include "cuda/base/queue.h"
#include "cuda/packing/banded/banded_pack.h"
#include "cuda/packing/calibrate/on_gpu.h"
#include "cuda/packing/grids/pack_grids.h"
#include "cuda/packing/mesh/device_mesh.h"
#include "mesh/mesh_solid.h"
#include "packing/base/packing_settings.h"

namespace ist::gpu {
namespace {

class CudaBackend final : public SolidBackend {
 public:
  /// `is_second`: there is another backend, whose work comes first. `tree`: the solid's, if
  /// present.
  CudaBackend(const MeshSolid& solid, const GpuSettings& settings, bool is_second = false,
              const WideTree* tree = nullptr)
      : solid_(solid),
        settings_(settings),
        is_second_(is_second),
        queue_(settings_, is_second),
        tree_(tree) {}

  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) override {
    const UnitFrame frame = solid_.frame();
    Stage stage("pack", progress, settings.time_limit);
    SpherePacking result =
        settings.grid == GridMode::banded
            ? pack_banded(queue_, tree(), packing::packing_limits(solid_, frame.scale(), settings),
                          stage)
            : pack_grids(queue_, solid_, settings, stage);
    result.frame = frame;
    return result;
  }

  std::vector<MedialNode> medial_nodes(const MedialSettings& settings) override {
    return gpu::medial_nodes(queue_, solid_, settings);
  }

  RelaxedSites relax_sites(const RelaxTask& task,
                           const std::function<void(double)>& report) override {
    return gpu::relax_sites(queue_, tree(), task, report);
  }

  double largest_protrusion(std::span<const Sphere> balls) override {
    return gpu::largest_protrusion(queue_, tree(), balls);
  }

  std::vector<double> cover_radii(const CoverTask& task,
                                  const std::function<void(int)>& report) override {
    return gpu::cover_radii(queue_, tree(), task, report);
  }

  std::unique_ptr<SolidBackend> with(const MeshSolid& other) const override {
    return std::make_unique<CudaBackend>(other, settings_, is_second_);
  }

  /// A caller's stream and memory serve one thread only.
  std::function<std::unique_ptr<SolidBackend>()> beside() override {
    if (settings_.stream != nullptr || settings_.memory != nullptr) return {};
    tree();
    queue_.wait();
    return [this] { return std::make_unique<CudaBackend>(solid_, settings_, true, tree_); };
  }

  bool leaves_threads_idle() const override { return true; }

 private:
  /// The mesh's hierarchy, built at the first use: the grids have none.
  const WideTree& tree() {
    if (tree_ == nullptr) tree_ = &mesh_.emplace(queue_, solid_.arrays()).tree();
    return *tree_;
  }

  const MeshSolid& solid_;
  const GpuSettings settings_;
  const bool is_second_;
  Queue queue_;
  std::optional<DeviceMesh> mesh_;
  const WideTree* tree_;
};

}  // namespace

std::unique_ptr<SolidBackend> make_cuda_backend(const MeshSolid& solid,
                                                const GpuSettings& settings) {
  check_gpu(settings.device);
  return std::make_unique<CudaBackend>(solid, settings);
}

}  // namespace ist::gpu
