#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <ist/cover_spheres.h>

#include "robots/covers/offset_surface.h"
#include "robots/covers/sampled_solid.h"

namespace ist {

/// Centres, and the level at which the largest balls around them (OffsetSurface::radius) contain
/// the surface.
struct LevelCover {
  std::vector<Eigen::Vector3d> centres;  ///< unit frame
  double level = 0;                      ///< unit frame
};

/// A cover at its level, and its balls as they were looked at.
struct LookedCover {
  LevelCover cover;
  std::vector<CoverSphere> balls;  ///< unit frame
};

/// Moves centres so that the level falls. One ball at a time: of the targets that no other ball
/// contains at a level a little lower, its farthest is brought as near as can be.
///
/// What samples do not tell is looked for as it goes on: places of the surface outside all balls
/// become targets, and places that a ball reaches beyond the level become rays.
class [[gnu::visibility("hidden")]] CoverDescent {
 public:
  /// `sampled`: takes the targets and rays that are found.
  CoverDescent(const MeshSolid& solid, SampledSolid& sampled) : solid_(solid), sampled_(sampled) {}

  /// Starts from centres that contain the samples, at about the level given, and ends when the
  /// level falls by a few thousandths no more, or after so many rounds over all balls. The level
  /// that comes back is about that of the surface itself (open_corners(), rays): a guess. `look` is
  /// called now and then.
  LookedCover improve(LevelCover start, int rounds, const std::function<void()>& look);

 private:
  struct Balls;
  class Round;
  double add_targets(const std::vector<CoverSphere>& balls, double level);
  double add_void(const std::vector<CoverSphere>& balls, double level);
  double add_rays(const OffsetSurface& surface, const std::vector<CoverSphere>& balls);

  const MeshSolid& solid_;
  SampledSolid& sampled_;
  std::vector<CoverSphere> vouched_;    ///< centres, and levels which they were seen to keep to
  std::vector<std::uint32_t> holders_;  ///< of triangles, at the last look
};

}  // namespace ist
