#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ist {

/// [point] the smallest index among those that are used and have equal coordinates (−0 = 0);
/// anything for points that are not used. `used` [point]: 0 or 1. Used coordinates must be finite.
/// On the caller's TBB threads.
std::vector<std::uint32_t> first_equal(const std::vector<Eigen::Vector3d>& points,
                                       const std::vector<std::uint8_t>& used);

}  // namespace ist
