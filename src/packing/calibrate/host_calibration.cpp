#include "packing/calibrate/host_calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "packing/calibrate/column_lattice.h"
#include "packing/calibrate/power_cells.h"
#include "packing/calibrate/protrusion.h"

namespace ist {

RelaxedSites relax_on_host(const MeshSolid& solid, const RelaxTask& task,
                           const std::function<void(double)>& report) {
  const ColumnLattice lattice = cut_columns(solid, task.columns);
  if (!columns_measure(lattice.volume(), task.volume)) return {};
  std::vector<PowerSite> sites(task.sites.begin(), task.sites.end());
  const PowerOctree octree(lattice);
  std::vector<double> shares(sites.size());
  for (int round = 0; round < kRelaxations; ++round) {
    report(static_cast<double>(round) / kRelaxations);
    const std::vector<PowerSums> sums = octree.cell_sums(sites);
    std::int64_t total = 0;
    for (const PowerSums& sum : sums) total += sum.length;
    for (std::size_t k = 0; k < sites.size(); ++k) {
      shares[k] = share_of(sums[k], total);
      relax(sites[k], sums[k], total, task.volume);
    }
  }
  return {std::move(sites), std::move(shares)};
}

double protrusion_on_host(const MeshSolid& solid, std::span<const Sphere> balls) {
  std::vector<double> out(balls.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t k) {
    const Eigen::Vector3d centre(balls[k].x, balls[k].y, balls[k].z);
    out[k] = protrusion_of(balls[k].r, solid.closest_point(centre).distance, solid.inside(centre));
  });
  return std::max(0.0, *std::max_element(out.begin(), out.end()));
}

}  // namespace ist
