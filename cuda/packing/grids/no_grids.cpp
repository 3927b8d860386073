// The grid functions of a build without the paper's grids: all of them throw.
#include "cuda/packing/grids/pack_grids.h"

namespace ist::gpu {

SpherePacking pack_grids(Queue&, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage) {
  return packing::pack_grids(solid, settings, stage);
}

std::vector<MedialNode> medial_nodes(Queue&, const MeshSolid& solid,
                                     const MedialSettings& settings) {
  return packing::medial_nodes_on_host(solid, settings);
}

}  // namespace ist::gpu
