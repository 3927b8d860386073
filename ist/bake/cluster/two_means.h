#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// Orders balls so that consecutive groups of 16, of 16², … are compact: recursive weighted 2-means
/// (weights r³), every cut at a multiple of the largest power of 16 below the number of balls, so
/// that all groups but the last are full (docs/design.md 6). With `last_stays` the last ball keeps
/// its place: it stands for a group that is not full.
std::vector<std::uint32_t> two_means_order(std::span<const Ball> balls, bool last_stays);

}  // namespace ist
