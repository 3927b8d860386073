#include "bake/backend/make_backend.h"

#include "base/thread_arena.h"
#include "cuda/packing/cuda_backend.h"
#include "packing/banded/banded_packer.h"
#include "packing/banded/field_surface.h"
#include "packing/banded/mesh_surface.h"
#include "packing/base/packing_settings.h"
#include "packing/calibrate/host_calibration.h"
#include "packing/cover/cover.h"
#include "packing/grids/pack_grids.h"

namespace ist {

namespace {

class HostBackend final : public SolidBackend {
 public:
  explicit HostBackend(const Solid& solid) : solid_(solid) {}

  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) override {
    return pack_on_host(solid_, settings, progress);
  }

  std::vector<MedialNode> medial_nodes(const MedialSettings& settings) override {
    return packing::medial_nodes_on_host(mesh(), settings);
  }

  RelaxedSites relax_sites(const RelaxTask& task,
                           const std::function<void(double)>& report) override {
    return relax_on_host(mesh(), task, report);
  }

  double largest_protrusion(std::span<const Sphere> balls) override {
    return protrusion_on_host(mesh(), balls);
  }

  std::vector<double> cover_radii(const CoverTask& task,
                                  const std::function<void(int)>& report) override {
    return cover_on_host(mesh(), task, report);
  }

  std::unique_ptr<SolidBackend> with(const MeshSolid& other) const override {
    return make_host_backend(other);
  }

 private:
  const MeshSolid& mesh() const {
    if (solid_.mesh() == nullptr)
      throw Error(
          "grids, cells and covers need a mesh, and this solid is not one; use the banded mode");
    return *solid_.mesh();
  }

  const Solid& solid_;
};

}  // namespace

SpherePacking pack_on_host(const Solid& solid, const PackingSettings& settings,
                           const ProgressCallback& progress) {
  const MeshSolid* const mesh = solid.mesh();
  const UnitFrame frame = mesh != nullptr ? mesh->frame() : unit_frame(solid.bounds());
  Stage stage("pack", progress, settings.time_limit);
  SpherePacking result;
  const auto pack_banded = [&](const auto& surface) {
    const packing::PackingLimits limits = packing::packing_limits(solid, frame.scale(), settings);
    result = packing::BandedPacker(surface, limits, stage).run();
  };
  if (settings.grid != GridMode::banded && mesh == nullptr)
    throw Error(
        "packing: only the banded mode packs solids that are not meshes; set grid to banded");
  if (settings.grid != GridMode::banded)
    result = packing::pack_grids(*mesh, settings, stage);
  else if (mesh != nullptr)
    pack_banded(packing::MeshSurface(*mesh));
  else
    pack_banded(packing::FieldSurface(solid, frame));
  result.frame = frame;
  return result;
}

std::unique_ptr<SolidBackend> make_host_backend(const Solid& solid) {
  return std::make_unique<HostBackend>(solid);
}

// The only place that knows all backends.
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, Device device,
                                           const GpuSettings& gpu) {
  const bool on_gpu =
      solid.mesh() != nullptr &&
      (device == Device::cuda || (device == Device::automatic && gpu_available(gpu.device)));
  return on_gpu ? ist::gpu::make_cuda_backend(*solid.mesh(), gpu) : make_host_backend(solid);
}

std::vector<MedialNode> medial_nodes(const Solid& solid, const MedialSettings& settings) {
  if (solid.mesh() == nullptr) throw Error("medial axis: the solid must be a mesh");
  if (settings.resolution > kMostGridCells)
    throw Error("medial axis: resolution is " + std::to_string(settings.resolution) +
                ", must be at most " + std::to_string(kMostGridCells) + " (0 = automatic)");
  return thread_arena(settings.threads).execute([&] {
    return make_backend(solid, settings.device, settings.gpu)->medial_nodes(settings);
  });
}

SpherePacking pack(const Solid& solid, const PackingSettings& settings,
                   const ProgressCallback& progress) {
  packing::check_settings(settings);
  return thread_arena(settings.threads).execute([&] {
    return make_backend(solid, settings.device, settings.gpu)->pack(settings, progress);
  });
}

}  // namespace ist
