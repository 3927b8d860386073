#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

/// (0, 1] of the level: how far spheres may protrude from a place of the surface outward, unit
/// frame; a direction of zero: any. Thread-safe.
using LevelShare =
    std::function<double(const Eigen::Vector3d& place, const Eigen::Vector3d& outward)>;

/// A ray out of the solid that starts on its surface: foot + t · direction is t away from the
/// solid, for every t in [0, reach].
struct OutwardRay {
  Eigen::Vector3d foot, direction;  ///< unit frame, direction of unit length
  double reach = 0;                 ///< unit frame
  double share = 1;                 ///< of the level: how far a ball may protrude here
};

/// A solid by points, unit frame. What is made of it is a guess; proofs look at the mesh.
struct SampledSolid {
  std::vector<Eigen::Vector3d> targets;  ///< of the solid: corners, edges, faces, inside
  std::size_t tight = 0;                 ///< of them, the first: where the share is small
  std::vector<OutwardRay> rays;          ///< from its outer surface
  double spacing = 0;                    ///< unit frame, of the targets on faces
  LevelShare share;                      ///< null: 1
  double most = std::numeric_limits<double>::infinity();  ///< that a share of any level may be
};

/// Samples faces so densely that some `targets` points come of them, and twice as dense where the
/// share is small; rays stand twice as dense near edges too. Inner walls of overlapping shells give
/// targets but no rays.
SampledSolid sample_solid(const MeshSolid& solid, std::size_t targets, LevelShare share = {});

}  // namespace ist
