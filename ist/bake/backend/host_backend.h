#pragma once

#include <memory>

#include "packing/backend/solid_backend.h"

namespace ist {

/// The seam's host implementation. What only meshes can be asked throws Error for other solids.
std::unique_ptr<SolidBackend> make_host_backend(const Solid& solid);

}  // namespace ist
