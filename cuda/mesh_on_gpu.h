#pragma once

#include <ist/packing.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "build/cover_cells.h"
#include "build/power_relaxation.h"
#include "mesh/mesh_solid.h"
#include "query/asset_layout.h"

namespace ist::gpu {

/// A mesh in the memory of a GPU, and the queue that everything about it runs on: what pack() and
/// bake() see of the GPU backend. Needs no CUDA header. For one thread at a time.
class MeshOnGpu {
 public:
  /// Uploads the mesh and builds its hierarchy. Keeps a reference to the solid. Throws Error if
  /// the GPU cannot be used (always in a build without CUDA), with the way out.
  MeshOnGpu(const MeshSolid& solid, const GpuSettings& settings);
  ~MeshOnGpu();
  MeshOnGpu(const MeshOnGpu&) = delete;
  MeshOnGpu& operator=(const MeshOnGpu&) = delete;

  /// pack(), bit for bit as on the CPU. The settings have been checked.
  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress);

  /// Relaxes sites within the solid's columns; none if the columns cannot measure the solid.
  /// `report(part)`: the part of it that is done, [0, 1].
  RelaxedSites relax_sites(const ColumnPlan& plan, std::span<const PowerSite> sites, double volume,
                           const std::function<void(double)>& report);

  /// How far any of the balls (unit frame) sticks out of the solid at most, at least 0.
  double largest_protrusion(std::span<const Sphere4> balls);

  /// The cover radii before they are rounded to float. `report(depth)`: before each level.
  std::vector<double> cover_radii(const CoverTask& task, const std::function<void(int)>& report);

  const GpuSettings& settings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ist::gpu
