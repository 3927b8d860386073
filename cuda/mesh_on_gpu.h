#pragma once

#include <ist/packing.h>

#include <memory>

#include "mesh/mesh_solid.h"

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

  std::size_t peak_bytes() const;  ///< most device memory that was in use at a time

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ist::gpu
