// What a build without CUDA says.
#include <ist/error.h>
#include <ist/gpu.h>
#include <ist/gpu_fields.h>
#include <ist/gpu_query.h>

#include "cuda/cuda_backend.h"

namespace ist {

bool gpu_available(int, std::string* why) {
  if (why != nullptr) *why = "this build has no GPU backend";
  return false;
}

GpuInfo gpu_info(int) { throw Error("GPU: this build has no GPU backend: use the CPU"); }

struct GpuAssets::Impl {};
GpuAssets::GpuAssets(std::span<const TreeView>, const GpuSettings& settings) {
  gpu_info(settings.device);
}
GpuAssets::~GpuAssets() = default;
GpuAssets::GpuAssets(GpuAssets&&) noexcept = default;
GpuAssets& GpuAssets::operator=(GpuAssets&&) noexcept = default;
std::size_t GpuAssets::size() const noexcept { return 0; }
std::size_t GpuAssets::bytes() const noexcept { return 0; }
int GpuAssets::device() const noexcept { return 0; }

struct GpuWorkspace::Impl {};
GpuWorkspace::GpuWorkspace(std::size_t, const GpuSettings& settings) { gpu_info(settings.device); }
GpuWorkspace::~GpuWorkspace() = default;
GpuWorkspace::GpuWorkspace(GpuWorkspace&&) noexcept = default;
GpuWorkspace& GpuWorkspace::operator=(GpuWorkspace&&) noexcept = default;
std::size_t GpuWorkspace::most_pairs() const noexcept { return 0; }
std::size_t GpuWorkspace::bytes() const noexcept { return 0; }

void penetration_batch(const GpuAssets&, const GpuPairs&, Measure, GpuWorkspace&,
                       const GpuPenetrations&, CUstream_st*) {
  gpu_info(0);
}

void penetration_batch(const GpuAssets&, const GpuPairs&, const GpuPenetrationSettings&,
                       GpuWorkspace&, const GpuPenetrations&, CUstream_st*) {
  gpu_info(0);
}

struct GpuFields::Impl {};
GpuFields::GpuFields(std::span<const Field>, const GpuSettings& settings) {
  gpu_info(settings.device);
}
GpuFields::~GpuFields() = default;
GpuFields::GpuFields(GpuFields&&) noexcept = default;
GpuFields& GpuFields::operator=(GpuFields&&) noexcept = default;
std::size_t GpuFields::size() const noexcept { return 0; }
std::size_t GpuFields::bytes() const noexcept { return 0; }
int GpuFields::device() const noexcept { return 0; }

void penetration_batch(const GpuAssets&, const GpuFields&, const GpuPairs&, Measure, GpuWorkspace&,
                       const GpuPenetrations&, CUstream_st*) {
  gpu_info(0);
}

void separation_batch(const GpuAssets&, const GpuPairs&, std::uint32_t, GpuWorkspace&,
                      const GpuSeparations&, CUstream_st*) {
  gpu_info(0);
}

void contact_patches_batch(const GpuAssets&, const GpuPairs&, Measure, GpuWorkspace&,
                           const GpuPenetrations&, const GpuContactPatches&, CUstream_st*) {
  gpu_info(0);
}

namespace gpu {

std::unique_ptr<SolidBackend> make_cuda_backend(const MeshSolid&, const GpuSettings& settings) {
  gpu_info(settings.device);
  return nullptr;
}

}  // namespace gpu

}  // namespace ist
