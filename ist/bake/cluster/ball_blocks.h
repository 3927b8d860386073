#pragma once

#include <span>
#include <vector>

#include <ist/types.h>

#include <ist/asset_layout.h>
#include "bake/cluster/bounding_ball.h"

namespace ist {

/// Packs float balls, sixteen to a block; origin + offset is every centre exactly.
void fill_blocks(std::span<const Sphere> balls, std::vector<BallBlock>& blocks,
                 std::vector<Origin>& origins);

/// A float ball around balls; the centre is rounded first, the radius about it rounded up.
Sphere ball_around(std::span<const Ball> balls);

}  // namespace ist
