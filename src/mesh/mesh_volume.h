#pragma once

#include "mesh/mesh_view.h"

namespace ist {

struct MeshVolume {
  double value = 0;  ///< unit frame³
  double error = 0;  ///< bound on the error of value
};

/// Volume of the set where the winding number is ≥ 1 (DESIGN 3.6).
MeshVolume mesh_volume(const MeshView& mesh);

}  // namespace ist
