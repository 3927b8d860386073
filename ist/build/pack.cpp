#include "build/pack.h"

#include "packing/pack_on_cpu.h"
#include "packing/packing_settings.h"

namespace ist {

std::unique_ptr<gpu::MeshOnGpu> put_on_gpu(const Solid& solid, const PackingSettings& settings) {
  if (settings.device == Device::cpu) return nullptr;
  const auto* const mesh = dynamic_cast<const MeshSolid*>(&solid);
  const bool wanted = settings.device == Device::cuda || gpu_available(settings.gpu.device);
  return mesh != nullptr && wanted ? std::make_unique<gpu::MeshOnGpu>(*mesh, settings.gpu)
                                   : nullptr;
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
