#pragma once

#include <ist/packing.h>

#include <memory>

#include "mesh_on_gpu.h"

namespace ist {

/// Whether a mesh is for the GPU: asked for by name, or left open where there is one.
bool wants_gpu(Device device, const GpuSettings& gpu);

/// The solid in the memory of the GPU that the settings ask for, or null where the CPU is to do it:
/// by choice, because there is no GPU, or because the solid is no mesh. Throws Error where a GPU
/// was asked for by name and cannot be used.
std::unique_ptr<gpu::MeshOnGpu> put_on_gpu(const Solid& solid, const PackingSettings& settings);

/// pack() where the solid is on a GPU already; on the CPU if `gpu` is null.
SpherePacking pack(const Solid& solid, gpu::MeshOnGpu* gpu, const PackingSettings& settings,
                   const ProgressCallback& progress);

}  // namespace ist
