#pragma once

#include <functional>

#include "mesh/mesh_view.h"

namespace ist {

struct MeshVolume {
  double value = 0;  ///< unit frame³
  double error = 0;  ///< unit frame³
};

/// Gives a mesh with its hierarchy, from any thread.
using HierarchyMaker = std::function<const MeshView&()>;

/// Volume of a mesh by the divergence theorem: ∫ winding number. The error is a proven bound on the
/// rounding. Where the winding number is only 0 or 1, this is the volume of the solid.
MeshVolume enclosed_volume(const MeshView& mesh);

/// Volume of the set where the winding number is ≥ 1 (docs/design.md 3.6): the enclosed volume less
/// the excess ∫ (winding − [winding ≥ 1]), integrated exactly along x and adaptively along y and z.
/// No excess, no loss of accuracy. The error of the excess is estimated: the bends of the last
/// intervals, summed without signs, and, unless `meets_itself` is false, what folds of the surface
/// may hide between the columns. The same for any number of threads. Of `mesh` the arrays suffice;
/// the hierarchy is asked for only where there is an excess.
MeshVolume winding_set_volume(const MeshView& mesh, bool meets_itself,
                              const HierarchyMaker& hierarchy);

}  // namespace ist
