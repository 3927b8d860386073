#pragma once

#include "cuda/base/queue.h"
#include "packing/grids/pack_grids.h"

namespace ist::gpu {

/// Packs a mesh on the paper's grids (settings.grid, not banded): the same bytes as
/// packing::pack_grids().
SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage);

/// The first round of such a packing (packing::medial_nodes_on_host()).
std::vector<MedialNode> medial_nodes(Queue& queue, const MeshSolid& solid,
                                     const MedialSettings& settings);

}  // namespace ist::gpu
