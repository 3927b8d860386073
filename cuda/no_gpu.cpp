// What a build without CUDA says.
#include <ist/error.h>
#include <ist/gpu.h>

namespace ist {

bool gpu_available(int, std::string* why) {
  if (why != nullptr) *why = "this build has no GPU backend";
  return false;
}

GpuInfo gpu_info(int) { throw Error("GPU: this build has no GPU backend: bake with --device cpu"); }

}  // namespace ist
