#pragma once

#include <memory>

#include "packing/grids/grid_backend.h"

namespace ist::packing {

/// The rounds' work on the threads of the current arena. Keeps `mesh`.
std::unique_ptr<GridBackend> make_host_grid_backend(const MeshView& mesh);

}  // namespace ist::packing
