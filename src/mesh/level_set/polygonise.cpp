#include "mesh/level_set/polygonise.h"

#include <algorithm>

namespace ist {

Polygonised polygonise(const Solid& solid, unsigned cells, const ProgressCallback& progress) {
  if (cells < kFewestCells || cells > kMostCells)
    throw Error("polygonise: " + std::to_string(cells) + " cells requested; the number must be " +
                std::to_string(kFewestCells) + " to " + std::to_string(kMostCells));
  Stage stage("polygonise", progress);
  stage.step(0, 0);
  const CellGrid grid = grid_around(solid, cells);
  std::vector<SurfaceCell> listed = find_surface_cells(
      solid, grid, [&](int level, int levels) { stage.step(0, 0.2 * level / levels); });
  const bool seen = std::any_of(listed.begin(), listed.end(),
                                [](const SurfaceCell& cell) { return cell.loops > 0; });
  if (!seen)
    throw Error(
        "solid: a grid of " + std::to_string(cells) +
        " cells along the longest side does not resolve it. Use more cells, or tighter bounds");
  return dual_mesh(solid, grid, std::move(listed), stage);
}

}  // namespace ist
