#include "mesh_on_gpu.h"

#include <ist/error.h>

#include "banded_pack.h"
#include "device_mesh.h"
#include "pack_grids.h"
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
  Impl(const MeshSolid& mesh, const GpuSettings& settings)
      : solid(mesh), queue(usable(settings)), device(queue, host_mesh(mesh.arrays())) {}

  const MeshSolid& solid;
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

std::size_t MeshOnGpu::peak_bytes() const { return impl_->queue.peak_bytes(); }

}  // namespace ist::gpu
