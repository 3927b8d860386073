#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

#include "base/host_device.h"
#include "query/asset/shared_constants.h"

// Balls of an asset's trees in plain numbers, on the CPU and on the GPU; unit frame.

namespace ist {

struct NodeBall {
  double centre[3] = {};
  double r = 0;
};

struct RootBall {
  double centre[3];
  double r;      ///< contains its spheres
  double cover;  ///< contains its cover balls

  IST_HD static RootBall of(const double (&root)[4], double cover) noexcept {
    return {{root[0], root[1], root[2]}, root[3], cover};
  }
  IST_HD double reach() const noexcept { return r > cover ? r : cover; }
};

/// The ball in a lane of a block, at full precision.
IST_HD inline NodeBall lane_ball(const BallBlock& b, const Origin& o, std::uint32_t lane) noexcept {
  return {{o.x + static_cast<double>(b.x[lane]), o.y + static_cast<double>(b.y[lane]),
           o.z + static_cast<double>(b.z[lane])},
          static_cast<double>(b.r[lane])};
}

/// Cube of the typical radius of a level's nodes, up to a factor common to all trees.
IST_HD inline double typical_cube(double root, std::uint32_t count) noexcept {
  return root * root * root / count;
}

/// True if A's node is the larger one, which is opened next. `scale`: of B in A's unit frame.
IST_HD inline bool opens_a(int level_a, double cube_a, int level_b, double cube_b,
                           double scale) noexcept {
  return level_b == kSphereLevel ||
         (level_a != kSphereLevel && cube_a >= scale * scale * scale * cube_b);
}

}  // namespace ist
