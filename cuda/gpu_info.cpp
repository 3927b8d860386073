#include <cuda_runtime_api.h>
#include <ist/error.h>
#include <ist/gpu.h>

#include "cuda/check.h"

namespace ist {
namespace {

/// nullptr if device `device` can run this build's kernels.
const char* obstacle(int device) {
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  cudaGetLastError();
  int driver = 0;
  if (status == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess &&
      driver != 0)
    return "the GPU driver is older than CUDA 13";
  if (status != cudaSuccess || count == 0) return "there is no GPU here, or no driver for it";
  if (device < 0 || device >= count) return "there is no GPU of that index";
  cudaDeviceProp properties{};
  if (cudaGetDeviceProperties(&properties, device) != cudaSuccess) {
    cudaGetLastError();
    return "the GPU does not answer";
  }
  if (properties.major < 9) return "the GPU is older than compute capability 9.0";
  return nullptr;
}

}  // namespace

bool gpu_available(int device, std::string* why) {
  const char* const found = obstacle(device);
  if (found != nullptr && why != nullptr) *why = found;
  return found == nullptr;
}

GpuInfo gpu_info(int device) {
  std::string why;
  if (!gpu_available(device, &why)) throw Error("GPU: " + why + ": bake on the CPU");
  cudaDeviceProp properties{};
  gpu::check(cudaGetDeviceProperties(&properties, device), "asking the GPU for its properties");
  int previous = 0;
  gpu::check(cudaGetDevice(&previous), "asking for the current GPU");
  GpuInfo info;
  info.name = properties.name;
  info.compute_capability = 10 * properties.major + properties.minor;
  gpu::check(cudaSetDevice(device), "selecting the GPU");
  const cudaError_t status = cudaMemGetInfo(&info.free_memory, &info.total_memory);
  cudaSetDevice(previous);
  gpu::check(status, "asking the GPU for its memory");
  return info;
}

}  // namespace ist
