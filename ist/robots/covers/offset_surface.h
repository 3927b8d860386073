#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "robots/covers/point_grid.h"
#include "robots/covers/sampled_solid.h"

namespace ist {

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
