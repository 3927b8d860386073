#pragma once

#include <ist/bake.h>

#include "packing/backend/solid_backend.h"

namespace ist {

/// pack() on the threads of the current arena. The settings have been checked.
SpherePacking pack_on_host(const Solid& solid, const PackingSettings& settings,
                           const ProgressCallback& progress);

/// The seam's host implementation. What only meshes can be asked throws Error for other solids.
std::unique_ptr<SolidBackend> make_host_backend(const Solid& solid);

/// Makes the backend for a solid, which must outlive it: the GPU's if the solid is a mesh and
/// `device` asks for one, or is automatic and there is one; else the host's. Throws Error with
/// advice if `device` asks for a GPU that cannot be used.
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, Device device,
                                           const GpuSettings& gpu = {});

}  // namespace ist
