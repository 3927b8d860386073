#pragma once

#include <ist/types.h>

#include "mesh/mesh_solid.h"
#include "packing/backend/tasks.h"
#include "packing/calibrate/column_lattice.h"
#include "packing/calibrate/power_relaxation.h"

// The expensive parts of a calibration on the threads of the current arena; SolidBackend documents
// them.

namespace ist {

/// The octree over a solid's columns in host memory; refers to the lattice.
class PowerOctree {
 public:
  explicit PowerOctree(const ColumnLattice& solid);
  const PowerGrid& grid() const { return grid_; }

  /// The sums of every site's power cell within the solid. Integers: deterministic.
  std::vector<PowerSums> cell_sums(std::span<const PowerSite> sites) const;

 private:
  PowerGrid grid_;
  std::vector<std::vector<std::uint32_t>> flags_;
};

RelaxedSites relax_on_host(const MeshSolid& solid, const RelaxTask& task,
                           const std::function<void(double)>& report);

double protrusion_on_host(const MeshSolid& solid, std::span<const Sphere> balls);

}  // namespace ist
