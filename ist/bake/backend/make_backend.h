#pragma once

#include <ist/bake.h>

#include <memory>

#include "packing/backend/solid_backend.h"

namespace ist {

/// pack() on the threads of the current arena. The settings have been checked.
SpherePacking pack_on_host(const Solid& solid, const PackingSettings& settings,
                           const ProgressCallback& progress);

/// The seam's host implementation. What only meshes can be asked throws Error for other solids.
std::unique_ptr<SolidBackend> make_host_backend(const Solid& solid);

/// The backend for a solid, which must outlive it: a GPU's where one is asked for, or left open
/// and there, and the solid is a mesh; else the host's. Throws Error where a GPU is asked for by
/// name and cannot be used, with the way out.
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, Device device,
                                           const GpuSettings& gpu = {});

}  // namespace ist
