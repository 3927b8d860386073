#include "packing/grids/pack_grids.h"

#include <algorithm>

#include "packing/grids/host_rounds.h"

namespace ist::packing {

GridFigures grid_figures(const MeshSolid& solid, std::size_t memory) {
  GridFigures figures;
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const Eigen::Vector3d lower = solid.frame().to_unit(bounds.min());
  const Eigen::Vector3d upper = solid.frame().to_unit(bounds.max());
  for (int k = 0; k < 3; ++k) {
    figures.lower[k] = lower[k];
    figures.upper[k] = upper[k];
  }
  figures.volume = solid.unit_volume();
  figures.triangles = solid.arrays().triangle_count;
  figures.memory = memory;
  return figures;
}

SpherePacking pack_grids(const MeshSolid& solid, const PackingSettings& settings, Stage& stage) {
  constexpr std::size_t kHostMemory = std::size_t{512} << 20;
  return pack_grids_by(HostRounds(solid.arrays()), solid, settings, kHostMemory, stage);
}

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
  constexpr int kFewestContacts = 2;
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
