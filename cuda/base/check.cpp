#include "cuda/base/check.h"

#include <ist/types.h>

#include <string>

namespace ist::gpu {
namespace {

const char* advice_for(cudaError_t status) {
  switch (status) {
    case cudaErrorMemoryAllocation:
      return "free device memory, ask for fewer spheres, or bake on the CPU";
    case cudaErrorNoDevice:
    case cudaErrorInvalidDevice:
      return "no such GPU: bake on the CPU";
    case cudaErrorInsufficientDriver:
      return "the driver is older than CUDA 13: update it, or bake on the CPU";
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorUnsupportedPtxVersion:
    case cudaErrorJitCompilerNotFound:
      return "this build has no code for this GPU: build with its CMAKE_CUDA_ARCHITECTURES, or "
             "bake on the CPU";
    default:
      return "bake on the CPU, and report this";
  }
}

}  // namespace

void check(cudaError_t status, const char* doing) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears the error if it is not sticky, or the next call would report it
  throw Error(std::string("GPU: ") + doing + ": " + cudaGetErrorString(status) + " (" +
              cudaGetErrorName(status) + "): " + advice_for(status));
}

}  // namespace ist::gpu
