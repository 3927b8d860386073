// The GPU functions of a build without CUDA: all of them throw.
#include <ist/gpu.h>
#include <ist/gpu_query.h>
#include <ist/gpu_scene.h>

#include "cuda/packing/cuda_backend.h"

namespace ist {

bool gpu_available(int, std::string* why) {
  if (why != nullptr) *why = "this build has no GPU backend";
  return false;
}

GpuInfo gpu_info(int) { throw Error("GPU: this build has no GPU backend: use the CPU"); }

struct GpuSolids::Impl {};
GpuSolids::GpuSolids(std::span<const GpuSolid>, const GpuSettings& settings) {
  gpu_info(settings.device);
}
GpuSolids::~GpuSolids() = default;
GpuSolids::GpuSolids(GpuSolids&&) noexcept = default;
GpuSolids& GpuSolids::operator=(GpuSolids&&) noexcept = default;
std::size_t GpuSolids::size() const noexcept { return 0; }
std::size_t GpuSolids::bytes() const noexcept { return 0; }
int GpuSolids::device() const noexcept { return 0; }

struct GpuWorkspace::Impl {};
GpuWorkspace::GpuWorkspace(std::size_t, const GpuSettings& settings) { gpu_info(settings.device); }
GpuWorkspace::~GpuWorkspace() = default;
GpuWorkspace::GpuWorkspace(GpuWorkspace&&) noexcept = default;
GpuWorkspace& GpuWorkspace::operator=(GpuWorkspace&&) noexcept = default;
std::size_t GpuWorkspace::most_pairs() const noexcept { return 0; }
std::size_t GpuWorkspace::bytes() const noexcept { return 0; }

struct GpuKept::Impl {};
GpuKept::GpuKept(std::size_t, std::size_t, const GpuSettings& settings) {
  gpu_info(settings.device);
}
GpuKept::~GpuKept() = default;
GpuKept::GpuKept(GpuKept&&) noexcept = default;
GpuKept& GpuKept::operator=(GpuKept&&) noexcept = default;
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

struct GpuScene::Impl {};
GpuScene::GpuScene(const GpuSolids&, std::span<const GpuSceneBody>, const GpuSceneSettings&,
                   const GpuSettings& settings) {
  gpu_info(settings.device);
}
GpuScene::~GpuScene() = default;
GpuScene::GpuScene(GpuScene&&) noexcept = default;
GpuScene& GpuScene::operator=(GpuScene&&) noexcept = default;
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
