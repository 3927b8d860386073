#pragma once

#include <ist/bake.h>

#include "packing/backend/solid_backend.h"

namespace ist {

/// pack() on the threads of the current arena. The settings have been validated.
SpherePacking pack_on_host(const Solid& solid, const PackingSettings& settings,
                           const ProgressCallback& progress);

/// The host implementation of SolidBackend. Functions for meshes alone throw Error for other
/// solids.
std::unique_ptr<SolidBackend> make_host_backend(const Solid& solid);

/// Makes the backend for a solid, which must outlive it: the GPU's if the solid is a mesh and
/// `device` requests one, or is automatic and a GPU is available; else the host's. Throws Error
/// with advice if `device` requests a GPU that cannot be used.
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, Device device,
                                           const GpuSettings& gpu = {});

}  // namespace ist
