#include <ist/error.h>
#include <ist/medial.h>

#include <algorithm>

#include "medial_on_gpu.h"
#include "mesh/mesh_solid.h"
#include "packing/grids/host_backend.h"
#include "packing/grids/pack_grids.h"
#include "packing/thread_arena.h"

namespace ist {
namespace {

constexpr int kFewestContacts = 2;

/// Automatic: the refinements of hybrid packing's first grid that take some milliseconds on a GPU.
packing::GridLayout medial_layout(const MeshSolid& mesh, unsigned resolution) {
  constexpr int kRefinements = 3;
  const packing::GridFigures figures = packing::grid_figures(mesh, 0);
  GridSettings grids;
  grids.resolution = resolution;
  if (resolution > 0) return packing::grid_schedule(GridMode::uniform, grids, figures).first;
  return packing::grid_schedule(GridMode::explicit_refinement, grids, figures).level(kRefinements);
}

std::vector<packing::GridCandidate> converged_on_host(const MeshSolid& solid,
                                                      const packing::AscentSettings& ascent,
                                                      unsigned threads) {
  std::vector<packing::GridCandidate> converged;
  thread_arena(threads).execute([&] {
    const auto backend = packing::make_host_grid_backend(solid.arrays());
    backend->build(ascent.layout);
    backend->place_prototypes(ascent.layout);
    converged = backend->converged(ascent, [] { return true; });
  });
  return converged;
}

}  // namespace

std::vector<MedialNode> medial_nodes(const Solid& solid, const MedialSettings& settings) {
  const auto* const mesh = dynamic_cast<const MeshSolid*>(&solid);
  if (mesh == nullptr) throw Error("medial axis: only meshes have one here");
  if (settings.resolution > packing::kMostCellsPerSide)
    throw Error("medial axis: resolution is " + std::to_string(settings.resolution) +
                ", must be at most " + std::to_string(packing::kMostCellsPerSide) +
                " (0 = automatic)");
  packing::AscentSettings ascent;
  ascent.layout = medial_layout(*mesh, settings.resolution);
  ascent.seed = settings.seed;
  const bool on_gpu = settings.device == Device::cuda ||
                      (settings.device == Device::automatic && gpu_available(settings.gpu.device));
  std::vector<packing::GridCandidate> converged =
      on_gpu ? gpu::converged_on_gpu(mesh->arrays(), ascent.layout, ascent, settings.gpu)
             : converged_on_host(*mesh, ascent, settings.threads);
  std::erase_if(converged, [](const packing::GridCandidate& c) {
    return !(c.radius > 0) || c.contacts < kFewestContacts;
  });
  std::sort(converged.begin(), converged.end(),
            [](const auto& a, const auto& b) { return a.cell < b.cell; });
  const UnitFrame& frame = mesh->frame();
  std::vector<MedialNode> nodes;
  nodes.reserve(converged.size());
  for (const packing::GridCandidate& c : converged)
    nodes.push_back({frame.from_unit({c.centre.x, c.centre.y, c.centre.z}),
                     double{c.radius} * frame.scale(), c.contacts});
  return nodes;
}

}  // namespace ist
