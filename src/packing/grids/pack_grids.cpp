#include "packing/grids/pack_grids.h"

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

}  // namespace ist::packing
