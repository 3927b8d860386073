#pragma once

#include <ist/types.h>

#include "mesh/mesh_solid.h"
#include "packing/backend/solid_backend.h"

namespace ist {

/// The matched spheres of a solid: one ball for each cell of a partition of the solid, with the
/// cell's volume and centre of mass (docs/design.md 5).
struct Calibration {
  /// Unit frame, one for each inner sphere and in their order. Σ 4/3 π r³ is the solid's volume
  /// within 1e-6; every radius is > 0.
  std::vector<Sphere> matched;
  /// Unit frame, proven: no matched sphere protrudes further from the solid.
  double protrusion = 0;
};

/// Calibrates prefixes of a packing, each of `counts` separately: relaxed power cells seeded by the
/// inner spheres, integrated over columns of the solid. `backend`: the solid's. Same bytes for any
/// backend and number of threads, which are those of the current arena. `take(i, calibration)`
/// receives each result in order. Throws Error without spheres or if progress cancels.
void calibrate_prefixes(const MeshSolid& solid, SolidBackend& backend,
                        std::span<const Sphere> inner, std::span<const std::size_t> counts,
                        const ProgressCallback& progress,
                        const std::function<void(std::size_t, Calibration)>& take);

}  // namespace ist
