#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "numerics/hashing.h"

namespace ist {

/// A name for the cell of a grid that holds a point of the unit frame.
inline std::uint64_t cell_key(const Eigen::Vector3d& p, double cell) {
  std::uint64_t key = 0;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::int64_t>(std::floor(p[k] / cell));
    key = mixed(key + 0x9E3779B97F4A7C15ull + static_cast<std::uint64_t>(i));
  }
  return key;
}

}  // namespace ist
