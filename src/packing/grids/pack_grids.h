#pragma once

#include "mesh/mesh_solid.h"
#include "packing/grids/grid_packer.h"

namespace ist::packing {

/// What grid sizes are picked from; `memory` [bytes] for the grids.
GridFigures grid_figures(const MeshSolid& solid, std::size_t memory);

/// Packs a mesh on the paper's grids (settings.grid, not banded) with the threads of the current
/// arena.
SpherePacking pack_grids(const MeshSolid& solid, const PackingSettings& settings, Stage& stage,
                         std::vector<GridRound>* history = nullptr);

}  // namespace ist::packing
