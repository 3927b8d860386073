#include "packing/grids/medial_grids.h"

#include <algorithm>

#include "packing/grids/host_rounds.h"
#include "packing/grids/pack_grids.h"

namespace ist::packing {
namespace {

constexpr int kFewestContacts = 2;

}  // namespace

MedialGrids medial_grids(const MeshSolid& mesh, unsigned resolution) {
  constexpr int kRefinements = 3;
  constexpr std::size_t kMemory = std::size_t{512} << 20;
  const GridFigures figures = grid_figures(mesh, kMemory);
  GridSettings grids;
  if (resolution > 0) {
    grids.start = resolution;
    grids.refinements = 0;
    const int wanted = distance_resolution(figures);
    const int most = kMostGridCells / 2;
    grids.resolution = std::max(resolution, static_cast<unsigned>(std::min(wanted, most)));
  }
  const GridSchedule schedule = grid_schedule(GridMode::implicit_refinement, grids, figures);
  return {schedule.level(resolution > 0 ? 0 : kRefinements), schedule.level(schedule.distances)};
}

std::vector<MedialNode> medial_nodes_of(std::vector<GridCandidate> converged,
                                        const UnitFrame& frame) {
  std::erase_if(converged, [](const GridCandidate& c) {
    return !(c.radius > 0) || c.contacts < kFewestContacts;
  });
  std::sort(converged.begin(), converged.end(),
            [](const auto& a, const auto& b) { return a.cell < b.cell; });
  std::vector<MedialNode> nodes;
  nodes.reserve(converged.size());
  for (const GridCandidate& c : converged)
    nodes.push_back({frame.from_unit({c.centre.x, c.centre.y, c.centre.z}),
                     double{c.radius} * frame.scale(), c.contacts});
  return nodes;
}

std::vector<MedialNode> medial_nodes_on_host(const MeshSolid& mesh,
                                             const MedialSettings& settings) {
  return medial_nodes_by(HostRounds(mesh.arrays()), mesh, settings);
}

}  // namespace ist::packing
