// The GPU functions of a build without CUDA: all of them throw.
#include <ist/gpu.h>
#include <ist/gpu_query.h>
#include <ist/gpu_scene.h>

#include "cuda/packing/cuda_backend.h"

namespace ist {

struct GpuSolids::Impl {};
struct GpuWorkspace::Impl {};
struct GpuKept::Impl {};
struct GpuScene::Impl {};

bool gpu_available(int, std::string* why) {
  if (why != nullptr) *why = "this build has no GPU backend";
  return false;
}

GpuInfo gpu_info(int) { throw Error("GPU: this build has no GPU backend: use the CPU"); }

GpuSolids::GpuSolids(std::span<const GpuSolid>, const GpuSettings& settings) : impl_(nullptr) {
  gpu_info(settings.device);
}
std::size_t GpuSolids::size() const noexcept { return 0; }
std::size_t GpuSolids::bytes() const noexcept { return 0; }
int GpuSolids::device() const noexcept { return 0; }

GpuWorkspace::GpuWorkspace(std::size_t, const GpuSettings& settings) : impl_(nullptr) {
  gpu_info(settings.device);
}
std::size_t GpuWorkspace::most_pairs() const noexcept { return 0; }
std::size_t GpuWorkspace::bytes() const noexcept { return 0; }

GpuKept::GpuKept(std::size_t, std::size_t, const GpuSettings& settings) : impl_(nullptr) {
  gpu_info(settings.device);
}
std::size_t GpuKept::most_pairs() const noexcept { return 0; }
std::size_t GpuKept::bytes() const noexcept { return 0; }

void penetration_batch(const GpuSolids&, const GpuPairs&, const GpuPenetrationSettings&,
                       GpuWorkspace&, const GpuPenetrations&, CUstream_st*) {
  gpu_info(0);
}

void separation_batch(const GpuSolids&, const GpuPairs&, const GpuSeparationSettings&,
                      GpuWorkspace&, const GpuSeparations&, CUstream_st*) {
  gpu_info(0);
}

void contact_patches_batch(const GpuSolids&, const GpuPairs&, Measure, GpuWorkspace&,
                           const GpuPenetrations&, const GpuContactPatches&, CUstream_st*) {
  gpu_info(0);
}

GpuScene::GpuScene(const GpuSolids&, std::span<const GpuSceneBody>, const GpuSceneSettings&,
                   const GpuSettings& settings)
    : impl_(nullptr) {
  gpu_info(settings.device);
}
std::size_t GpuScene::size() const noexcept { return 0; }
std::size_t GpuScene::bytes() const noexcept { return 0; }
const GpuScenePairs& GpuScene::pairs() const noexcept {
  static const GpuScenePairs none;
  return none;
}
void GpuScene::find_pairs(const Pose*, CUstream_st*) { gpu_info(0); }

namespace gpu {

std::unique_ptr<SolidBackend> make_cuda_backend(const MeshSolid&, const GpuSettings& settings) {
  gpu_info(settings.device);
  return nullptr;
}

}  // namespace gpu

}  // namespace ist
