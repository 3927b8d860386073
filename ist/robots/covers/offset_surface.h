#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "mesh/mesh_solid.h"
#include "robots/covers/point_grid.h"

namespace ist {

/// (0, 1] of the level: the allowed protrusion of spheres from a place of the surface outward, unit
/// frame; zero direction: any. Thread-safe.
using LevelShare =
    std::function<double(const Eigen::Vector3d& place, const Eigen::Vector3d& outward)>;

/// A ray out of the solid that starts on its surface: foot + t · direction is t away from the
/// solid, for every t in [0, reach].
struct OutwardRay {
  Eigen::Vector3d foot, direction;  ///< unit frame, direction of unit length
  double reach = 0;                 ///< unit frame
  double share = 1;                 ///< of the level: the allowed protrusion of a ball here
};

/// A solid by points, unit frame. Results from it are unproven; proofs use the mesh.
struct SampledSolid {
  std::vector<Eigen::Vector3d> targets;  ///< of the solid: corners, edges, faces, inside
  std::size_t tight = 0;                 ///< the first targets: those with a small share
  std::vector<OutwardRay> rays;          ///< from its outer surface
  double spacing = 0;                    ///< unit frame, of the targets on faces
  LevelShare share;                      ///< null: 1
  double most = std::numeric_limits<double>::infinity();  ///< upper bound of a share of any level
};

/// Samples faces so densely that about `targets` points result, twice as densely where the share is
/// small; rays are twice as dense near edges too. Inner walls of overlapping shells give targets
/// but no rays.
SampledSolid sample_solid(const MeshSolid& solid, std::size_t targets, LevelShare share = {});

/// [unit frame] Depth of a point in the solid, negative outside; to float rounding.
double depth_in(const MeshSolid& solid, const Eigen::Vector3d& point);

/// The places at one distance from a solid, `level`, by points; a share of it where the solid is
/// tight. A ball within them protrudes by no more, up to the resolution of the points.
class [[gnu::visibility("hidden")]] OffsetSurface {
 public:
  OffsetSurface(const MeshSolid& solid, const SampledSolid& sampled, double level);

  double level() const { return level_; }

  /// Radius of the largest ball around `centre` that protrudes by no more than the level; 0 for a
  /// centre that is itself further out. It is the distance to the surface plus the level, unless
  /// the points show that it may be larger, as beside a hollow.
  double radius(const Eigen::Vector3d& centre) const {
    return radius(centre, depth_in(*solid_, centre));
  }
  /// The same if depth_in() is known.
  double radius(const Eigen::Vector3d& centre, double depth) const;

  /// The radius that the distance to the surface alone proves; 0 for a centre further out.
  double sure_radius(const Eigen::Vector3d& centre) const;

  /// Appends points within `reach`.
  void walls(const Eigen::Vector3d& centre, double reach, std::vector<Eigen::Vector3d>& out) const;

  /// Centres of largest balls, on the medial axis of the offset solid. At most about `most`.
  std::vector<Eigen::Vector3d> medial_centres(std::size_t most) const;

 private:
  const MeshSolid* solid_;
  double level_, spacing_;
  double least_;                          ///< level of all places
  double largest_;                        ///< no ball inside is larger
  PointGrid points_, tight_;              ///< all; those below the level
  std::vector<Eigen::Vector3d> normals_;  ///< by the places of points_
};

}  // namespace ist
