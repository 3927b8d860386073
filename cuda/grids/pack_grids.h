#pragma once

#include "packing/grids/pack_grids.h"

namespace ist::gpu {

class Queue;

/// The work of a grid packing's rounds on the GPU. `mesh`'s exact arrays are in use until the first
/// round. The backend must not outlive the queue.
std::unique_ptr<packing::GridBackend> make_grid_backend(Queue& queue, const MeshView& mesh);

/// Packs a mesh on the paper's grids (settings.grid, not banded): the same bytes as
/// packing::pack_grids().
SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         const ProgressCallback& progress,
                         std::vector<packing::GridRound>* history = nullptr);

}  // namespace ist::gpu
