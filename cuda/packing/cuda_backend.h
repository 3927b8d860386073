#pragma once

#include <memory>

#include "packing/backend/solid_backend.h"

namespace ist::gpu {

/// The CUDA implementation of SolidBackend: the mesh in the memory of a GPU, and the queue of its
/// work. Keeps a reference to the solid. Throws Error with advice if the GPU cannot be used (always
/// in a build without CUDA). Needs no CUDA header.
std::unique_ptr<SolidBackend> make_cuda_backend(const MeshSolid& solid,
                                                const GpuSettings& settings);

}  // namespace ist::gpu
