// What a build without CUDA says.
#include <ist/error.h>
#include <ist/gpu.h>

#include "cuda/cuda_backend.h"

namespace ist {

bool gpu_available(int, std::string* why) {
  if (why != nullptr) *why = "this build has no GPU backend";
  return false;
}

GpuInfo gpu_info(int) { throw Error("GPU: this build has no GPU backend: bake on the CPU"); }

namespace gpu {

std::unique_ptr<SolidBackend> make_cuda_backend(const MeshSolid&, const GpuSettings& settings) {
  gpu_info(settings.device);
  return nullptr;
}

}  // namespace gpu

}  // namespace ist
