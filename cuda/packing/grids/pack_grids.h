#pragma once

#include "cuda/base/queue.h"
#include "packing/grids/pack_grids.h"

namespace ist::gpu {

/// Packs a mesh on the paper's grids (settings.grid, not banded): the same bytes as
/// packing::pack_grids().
SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage);

}  // namespace ist::gpu
