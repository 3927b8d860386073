#pragma once

#include <cstdint>

#include <ist/pose.h>

namespace ist::testing {

/// A pair of a batch on a GPU: assets by their number.
struct BatchPair {
  std::uint32_t a = 0, b = 0;
  Pose pose_a, pose_b;
  double scale_a = 1, scale_b = 1;
};

}  // namespace ist::testing
