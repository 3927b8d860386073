#pragma once

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"

namespace ist {

/// A coarse estimate of the overlap of two trees, each a few balls that are evenly filled with the
/// volume of the spheres below. Smooth in the pose. A's unit frame.
struct QuickLook {
  double volume = 0;
  PoseSlope slope;
};

/// Uses the lowest levels of no more than 64 nodes. `slopes`: computes the derivatives, else 0.
QuickLook quick_look(const SphereTree& a, const SphereTree& b, const Similarity& a_from_b,
                     bool slopes) noexcept;

}  // namespace ist
