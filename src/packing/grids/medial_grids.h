#pragma once

#include <ist/bake.h>

#include "mesh/mesh_solid.h"
#include "packing/grids/ascent.h"

namespace ist::packing {

/// Grids of prototypes and distances of a medial axis. Automatic: for milliseconds on a GPU.
struct MedialGrids {
  GridLayout prototypes, distances;
};
MedialGrids medial_grids(const MeshSolid& mesh, unsigned resolution);

/// The nodes among converged prototypes, in the mesh's frame, ordered by cell.
std::vector<MedialNode> medial_nodes_of(std::vector<GridCandidate> converged,
                                        const UnitFrame& frame);

/// medial_nodes() with the rounds of a host or a device (ascent.h).
template <class Rounds>
std::vector<MedialNode> medial_nodes_by(Rounds&& rounds, const MeshSolid& mesh,
                                        const MedialSettings& settings) {
  const MedialGrids grids = medial_grids(mesh, settings.resolution);
  AscentSettings ascent;
  ascent.layout = grids.prototypes;
  ascent.seed = settings.seed;
  rounds.build(grids.distances);
  rounds.place_prototypes(ascent.layout);
  return medial_nodes_of(rounds.converged(ascent, [] { return true; }), mesh.frame());
}

/// The same with the threads of the current arena.
std::vector<MedialNode> medial_nodes_on_host(const MeshSolid& mesh, const MedialSettings& settings);

}  // namespace ist::packing
