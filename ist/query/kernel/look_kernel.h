#pragma once

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"

namespace ist {

/// A coarse estimate of the overlap of two trees: each is a few balls, evenly filled with the
/// volume of the spheres below. A smooth function of the pose. A's unit frame.
struct QuickLook {
  double volume = 0;
  PoseSlope slope;
};

/// QuickLook as vector code leaves it: plain numbers, by π/12; slopes by −π/4.
struct Looked {
  double volume = 0, by_translation[3] = {}, by_rotation[3] = {};
};

/// Uses the nodes of the lowest levels that have no more than 64. `slopes`: with the derivatives,
/// which are 0 otherwise.
QuickLook quick_look(const SphereTree& a, const SphereTree& b, const Similarity& a_from_b,
                     bool slopes) noexcept;

}  // namespace ist
