#include "bake/predict/inner_points.h"

#include <algorithm>
#include <cmath>

#include "mesh/line_lattice.h"

namespace ist {

using Eigen::Vector3d;

std::vector<Vector3d> inner_points(const MeshSolid& solid, std::size_t count) {
  constexpr double kMostLines = 1024;  // on a side
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const Vector3d low = solid.frame().to_unit(bounds.min());
  const Vector3d sizes = solid.frame().to_unit(bounds.max()) - low;
  const double step = std::cbrt(solid.unit_volume() / static_cast<double>(count));
  const auto lines = [&](double size) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil(size / step), 1.0, kMostLines));
  };
  LineLattice lattice;
  lattice.y0 = low.y();
  lattice.z0 = low.z();
  lattice.ny = lines(sizes.y());
  lattice.nz = lines(sizes.z());
  lattice.step_y = sizes.y() / lattice.ny;
  lattice.step_z = sizes.z() / lattice.nz;
  lattice.offset = kGoldenRatio / 2;
  lattice.shift = kGoldenRatio;
  const LatticeCrossings all = cross_lattice(solid.arrays(), lattice);

  // Along the lines, so that each stands for as much as a cell of the wanted step.
  const double along = step * step * step / (lattice.step_y * lattice.step_z);
  std::vector<Vector3d> points;
  double turned = 0;  // of the first point of a line, over the step
  for (std::uint32_t j = 0; j < lattice.nz; ++j)
    for (std::uint32_t i = 0; i < lattice.ny; ++i) {
      turned += kGoldenRatio;
      turned -= std::floor(turned);
      int winding = 0;
      double since = 0;
      const std::size_t line = std::size_t{j} * lattice.ny + i;
      for (std::uint32_t c = all.first[line]; c < all.first[line + 1]; ++c) {
        const Crossing& crossing = all.crossings[c];
        if (winding >= 1)
          for (double k = std::ceil((since - low.x()) / along - turned);
               low.x() + (k + turned) * along < crossing.x; ++k)
            points.push_back(solid.frame().from_unit(
                {low.x() + (k + turned) * along, lattice.y(i, j), lattice.z(j)}));
        winding += crossing.sign;
        since = crossing.x;
      }
    }
  return points;
}

}  // namespace ist
