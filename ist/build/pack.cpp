#include "build/pack.h"

#include "packing/pack_on_cpu.h"
#include "packing/packing_settings.h"

namespace ist {

bool wants_gpu(Device device, const GpuSettings& gpu) {
  return device == Device::cuda || (device == Device::automatic && gpu_available(gpu.device));
}

std::unique_ptr<gpu::MeshOnGpu> put_on_gpu(const Solid& solid, const PackingSettings& settings) {
  const auto* const mesh = dynamic_cast<const MeshSolid*>(&solid);
  if (mesh == nullptr || !wants_gpu(settings.device, settings.gpu)) return nullptr;
  return std::make_unique<gpu::MeshOnGpu>(*mesh, settings.gpu);
}

SpherePacking pack(const Solid& solid, gpu::MeshOnGpu* gpu, const PackingSettings& settings,
                   const ProgressCallback& progress) {
  packing::check_settings(settings);
  return gpu != nullptr ? gpu->pack(settings, progress)
                        : packing::pack_on_cpu(solid, settings, progress);
}

SpherePacking pack(const Solid& solid, const PackingSettings& settings,
                   const ProgressCallback& progress) {
  const auto gpu = put_on_gpu(solid, settings);
  return pack(solid, gpu.get(), settings, progress);
}

}  // namespace ist
