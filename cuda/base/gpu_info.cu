#include <cuda_runtime_api.h>
#include <ist/gpu.h>
#include <ist/types.h>

#include <string>

#include "cuda/base/check.h"
#include "cuda/base/queue.h"

namespace ist {
namespace {

constexpr int kOldest = 75;  // compute capability; CUDA 13 has none older

__global__ void any_kernel() {}  // all are compiled for the same architectures

/// Returns success if this build has code for the device. Creates the device's context.
cudaError_t find_code_for(int device) {
  int previous = 0;
  cudaError_t status = cudaGetDevice(&previous);
  if (status == cudaSuccess) status = cudaSetDevice(device);
  cudaFuncAttributes attributes{};
  if (status == cudaSuccess) status = cudaFuncGetAttributes(&attributes, any_kernel);
  if (previous != device) cudaSetDevice(previous);
  return status;
}

std::string with_point(int capability) {
  return std::to_string(capability / 10) + "." + std::to_string(capability % 10);
}

/// The reason why device `device` cannot run this build's kernels; empty if it can.
std::string obstacle(int device) {
  int count = 0;
  const cudaError_t found = cudaGetDeviceCount(&count);
  int driver = 0;
  if (found == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess &&
      driver != 0)
    return "the GPU driver is older than CUDA 13";
  if (found != cudaSuccess || count == 0) return "no GPU or GPU driver found";
  if (device < 0 || device >= count) return "no GPU with this index";
  const auto attribute = [device](cudaDeviceAttr which) {
    int value = 0;
    return cudaDeviceGetAttribute(&value, which, device) == cudaSuccess ? value : 0;
  };
  const int capability = 10 * attribute(cudaDevAttrComputeCapabilityMajor) +
                         attribute(cudaDevAttrComputeCapabilityMinor);
  if (capability == 0) return "the GPU does not answer";
  if (capability < kOldest)
    return "the GPU has compute capability " + with_point(capability) + ", and " +
           with_point(kOldest) + " is the oldest that ist runs on";
  if (attribute(cudaDevAttrCooperativeLaunch) == 0)
    return "the GPU or its driver's mode has no cooperative launch";
  if (attribute(cudaDevAttrMemoryPoolsSupported) == 0)
    return "the GPU or its driver's mode has no memory pools (cudaMallocAsync)";
  switch (const cudaError_t code = find_code_for(device)) {
    case cudaSuccess:
      return {};
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorInvalidDeviceFunction:
    case cudaErrorUnsupportedPtxVersion:
    case cudaErrorJitCompilerNotFound:
      return "this build has no code for compute capability " + with_point(capability) + " (" +
             cudaGetErrorName(code) +
             "): build it with -DCMAKE_CUDA_ARCHITECTURES=" + std::to_string(capability);
    default:
      return std::string("the GPU cannot be used: ") + cudaGetErrorString(code) + " (" +
             cudaGetErrorName(code) + ")";
  }
}

}  // namespace

bool gpu_available(int device, std::string* why) {
  const std::string found = obstacle(device);
  cudaGetLastError();  // clears the error if it is not sticky, or the next call would report it
  if (!found.empty() && why != nullptr) *why = found;
  return found.empty();
}

void gpu::check_gpu(int device) {
  std::string why;
  if (!gpu_available(device, &why)) throw Error("GPU: " + why + ": bake on the CPU");
}

GpuInfo gpu_info(int device) {
  gpu::check_gpu(device);
  cudaDeviceProp properties{};
  gpu::check(cudaGetDeviceProperties(&properties, device), "querying the GPU's properties");
  GpuInfo info;
  info.name = properties.name;
  info.compute_capability = 10 * properties.major + properties.minor;
  const gpu::DeviceGuard guard(device);
  gpu::check(cudaMemGetInfo(&info.free_memory, &info.total_memory), "querying the GPU's memory");
  return info;
}

}  // namespace ist
