#include <ist/error.h>
#include <ist/medial.h>

#include <algorithm>

#include "build/pack.h"
#include "grids/medial_on_gpu.h"
#include "mesh/mesh_solid.h"
#include "packing/grids/host_backend.h"
#include "packing/grids/pack_grids.h"
#include "packing/thread_arena.h"

namespace ist {
namespace {

constexpr int kFewestContacts = 2;

/// The grids of prototypes and distances. Automatic: as fine as takes milliseconds on a GPU.
struct MedialGrids {
  packing::GridLayout prototypes, distances;
};

MedialGrids medial_grids(const MeshSolid& mesh, unsigned resolution) {
  constexpr int kRefinements = 3;
  constexpr std::size_t kMemory = std::size_t{512} << 20;
  const packing::GridFigures figures = packing::grid_figures(mesh, kMemory);
  GridSettings grids;
  if (resolution > 0) {
    grids.start = resolution;
    grids.refinements = 0;
    const int wanted = packing::distance_resolution(figures);
    const int most = packing::kMostCellsPerSide / 2;
    grids.resolution = std::max(resolution, static_cast<unsigned>(std::min(wanted, most)));
  }
  const packing::GridSchedule schedule =
      packing::grid_schedule(GridMode::implicit_refinement, grids, figures);
  return {schedule.level(resolution > 0 ? 0 : kRefinements), schedule.level(schedule.distances)};
}

std::vector<packing::GridCandidate> converged_on_host(const MeshSolid& solid,
                                                      const packing::GridLayout& distances,
                                                      const packing::AscentSettings& ascent,
                                                      unsigned threads) {
  std::vector<packing::GridCandidate> converged;
  thread_arena(threads).execute([&] {
    const auto backend = packing::make_host_grid_backend(solid.arrays());
    backend->build(distances);
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
  const MedialGrids grids = medial_grids(*mesh, settings.resolution);
  ascent.layout = grids.prototypes;
  ascent.seed = settings.seed;
  std::vector<packing::GridCandidate> converged =
      wants_gpu(settings.device, settings.gpu)
          ? gpu::converged_on_gpu(mesh->arrays(), grids.distances, ascent, settings.gpu)
          : converged_on_host(*mesh, grids.distances, ascent, settings.threads);
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
