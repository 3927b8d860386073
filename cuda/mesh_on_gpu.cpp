#include "mesh_on_gpu.h"

#include <ist/error.h>

#include "bake/cover_on_gpu.h"
#include "bake/protrusion_on_gpu.h"
#include "bake/relax_on_gpu.h"
#include "banded/banded_pack.h"
#include "device_mesh.h"
#include "grids/pack_grids.h"
#include "packing/band_limits.h"
#include "queue.h"

namespace ist::gpu {
namespace {

const GpuSettings& usable(const GpuSettings& settings) {
  std::string why;
  if (!gpu_available(settings.device, &why))
    throw Error("GPU: " + why + ": bake with --device cpu");
  return settings;
}

HostMesh host_mesh(const MeshView& arrays) {
  HostMesh mesh;  // in the unit frame already
  mesh.vertices = arrays.vertices_exact;
  mesh.triangles = arrays.triangles;
  mesh.vertex_count = arrays.vertex_count;
  mesh.triangle_count = arrays.triangle_count;
  return mesh;
}

}  // namespace

struct MeshOnGpu::Impl {
  Impl(const MeshSolid& mesh, const GpuSettings& asked)
      : solid(mesh),
        settings(usable(asked)),
        queue(settings),
        device(queue, host_mesh(mesh.arrays())) {}

  const MeshSolid& solid;
  GpuSettings settings;
  Queue queue;
  DeviceMesh device;
};

MeshOnGpu::MeshOnGpu(const MeshSolid& solid, const GpuSettings& settings)
    : impl_(std::make_unique<Impl>(solid, settings)) {}

MeshOnGpu::~MeshOnGpu() = default;

SpherePacking MeshOnGpu::pack(const PackingSettings& settings, const ProgressCallback& progress) {
  const UnitFrame frame = impl_->solid.frame();
  const packing::BandLimits limits = packing::band_limits(impl_->solid, frame.scale(), settings);
  if (!(limits.volume > 0)) throw Error("packing: the solid's volume is not positive");
  SpherePacking result = settings.grid == GridMode::banded
                             ? pack_banded(impl_->queue, impl_->device.tree(), limits,
                                           frame.scale(), settings.time_limit, progress)
                             : pack_grids(impl_->queue, impl_->solid, settings, progress);
  result.frame = frame;
  return result;
}

RelaxedSites MeshOnGpu::relax_sites(const ColumnPlan& plan, std::span<const PowerSite> sites,
                                    double volume, const std::function<void(double)>& report) {
  return gpu::relax_sites(impl_->queue, impl_->device.tree(), plan, sites, volume, report);
}

double MeshOnGpu::largest_protrusion(std::span<const Sphere4> balls) {
  return gpu::largest_protrusion(impl_->queue, impl_->device.tree(), balls);
}

std::vector<double> MeshOnGpu::cover_radii(const CoverTask& task,
                                           const std::function<void(int)>& report) {
  return gpu::cover_radii(impl_->queue, impl_->device.tree(), task, report);
}

const GpuSettings& MeshOnGpu::settings() const { return impl_->settings; }

}  // namespace ist::gpu
