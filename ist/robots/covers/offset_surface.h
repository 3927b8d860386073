#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "mesh/mesh_solid.h"
#include "robots/covers/point_grid.h"

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

/// [unit frame] How deep a point lies in the solid, below 0 outside; to float rounding.
double depth_in(const MeshSolid& solid, const Eigen::Vector3d& point);

/// The places at one distance from a solid, `level`, by points; a share of it where the solid is
/// tight. A ball within them protrudes by no more, as far as the points tell.
class [[gnu::visibility("hidden")]] OffsetSurface {
 public:
  OffsetSurface(const MeshSolid& solid, const SampledSolid& sampled, double level);

  double level() const { return level_; }

  /// Radius of the largest ball around `centre` that protrudes by no more than the level; 0 for a
  /// centre that is itself further out. It is the distance to the surface and the level, but where
  /// the points, as coarse as they are, show that it may be more: beside a hollow.
  double radius(const Eigen::Vector3d& centre) const {
    return radius(centre, depth_in(*solid_, centre));
  }
  /// The same where depth_in() is known.
  double radius(const Eigen::Vector3d& centre, double depth) const;

  /// The radius that the distance to the surface alone proves; 0 for a centre further out.
  double sure_radius(const Eigen::Vector3d& centre) const;

  /// Points within `reach`, appended.
  void walls(const Eigen::Vector3d& centre, double reach, std::vector<Eigen::Vector3d>& out) const;

  /// Centres of largest balls: of the medial axis of what the surface contains. At most some
  /// `most`.
  std::vector<Eigen::Vector3d> medial_centres(std::size_t most) const;

 private:
  const MeshSolid* solid_;
  double level_, spacing_;
  double least_;                          ///< level of all places
  double largest_;                        ///< no ball inside is larger
  PointGrid points_, tight_;              ///< all; those at less than the level
  std::vector<Eigen::Vector3d> normals_;  ///< by the places of points_
};

}  // namespace ist
