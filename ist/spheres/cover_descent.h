#pragma once

#include <Eigen/Core>
#include <vector>

#include "spheres/point_tree.h"
#include "spheres/sampled_solid.h"

namespace ist {

/// Centres, and the level at which the largest balls around them (OffsetSurface::radius) hold all
/// targets.
struct LevelCover {
  std::vector<Eigen::Vector3d> centres;  ///< unit frame
  double level = 0;                      ///< unit frame
};

/// Moves centres so that the level falls. One ball at a time: of the targets that no other ball
/// holds at a level a little lower, its farthest is brought as near as can be.
class [[gnu::visibility("hidden")]] CoverDescent {
 public:
  CoverDescent(const MeshSolid& solid, const SampledSolid& sampled)
      : solid_(solid), sampled_(sampled), targets_(sampled.targets), tree_(sampled.targets) {}

  /// Lowers the level, at first by the share `step` of it, until a few thousandths fail, in
  /// `rounds` over all balls at most.
  LevelCover improve(LevelCover cover, double step, int rounds) const;

 private:
  class Round;
  const MeshSolid& solid_;
  const SampledSolid& sampled_;
  const std::vector<Eigen::Vector3d>& targets_;
  PointTree tree_;
};

}  // namespace ist
