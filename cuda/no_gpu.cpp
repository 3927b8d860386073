// What a build without CUDA says.
#include <ist/error.h>
#include <ist/gpu.h>

#include "grids/medial_on_gpu.h"
#include "mesh_on_gpu.h"

namespace ist {

bool gpu_available(int, std::string* why) {
  if (why != nullptr) *why = "this build has no GPU backend";
  return false;
}

GpuInfo gpu_info(int) { throw Error("GPU: this build has no GPU backend: bake with --device cpu"); }

namespace gpu {

std::vector<packing::GridCandidate> converged_on_gpu(const MeshView&, const packing::GridLayout&,
                                                     const packing::AscentSettings&,
                                                     const GpuSettings& gpu) {
  gpu_info(gpu.device);
  return {};
}
struct MeshOnGpu::Impl {};

MeshOnGpu::MeshOnGpu(const MeshSolid&, const GpuSettings&) { gpu_info(); }
MeshOnGpu::~MeshOnGpu() = default;
SpherePacking MeshOnGpu::pack(const PackingSettings&, const ProgressCallback&) { return {}; }
RelaxedSites MeshOnGpu::relax_sites(const ColumnPlan&, std::span<const PowerSite>, double,
                                    const std::function<void(double)>&) {
  return {};
}
double MeshOnGpu::largest_protrusion(std::span<const Sphere4>) { return 0; }
std::vector<double> MeshOnGpu::cover_radii(const CoverTask&, const std::function<void(int)>&) {
  return {};
}
const GpuSettings& MeshOnGpu::settings() const {
  static const GpuSettings none;
  return none;
}

}  // namespace gpu

}  // namespace ist
