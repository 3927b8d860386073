#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include <ist/cover_spheres.h>

#include "mesh/mesh_solid.h"

namespace ist {

/// A way out of the solid that starts on its surface: foot + t · direction is t away from the
/// solid, for every t in [0, reach].
struct OutwardRay {
  Eigen::Vector3d foot, direction;  ///< unit frame, direction of unit length
  double reach = 0;                 ///< unit frame
  double share = 1;                 ///< of the level: how far a ball may protrude here
};

/// A solid by points, unit frame. What is made of it is a guess; proofs look at the mesh.
struct SampledSolid {
  std::vector<Eigen::Vector3d> targets;  ///< of the solid: corners, edges, faces, inside
  std::vector<OutwardRay> rays;          ///< from its outer surface
  double spacing = 0;                    ///< unit frame, of the targets on faces
  std::vector<TightPlace> tight;         ///< unit frame

  double share_at(const Eigen::Vector3d& foot) const;
};

/// Samples faces so densely that some `targets` points come of them; rays stand twice as dense.
/// Inner walls of overlapping shells give targets but no rays.
SampledSolid sample_solid(const MeshSolid& solid, std::size_t targets,
                          std::vector<TightPlace> tight = {});

}  // namespace ist
