#pragma once

#include <cstdint>
#include <vector>

#include <ist/gpu_query.h>

#include "support/batch_pair.h"

namespace ist::testing {

/// Pairs as the arrays of a batch, in the host's memory.
struct PairColumns {
  explicit PairColumns(const std::vector<BatchPair>& pairs) {
    for (const BatchPair& pair : pairs) {
      a.push_back(pair.a);
      b.push_back(pair.b);
      pose_a.push_back(pair.pose_a);
      pose_b.push_back(pair.pose_b);
      scale_a.push_back(pair.scale_a);
      scale_b.push_back(pair.scale_b);
    }
  }
  GpuPairs pairs() const {
    return {a.size(),      a.data(),       b.data(),      pose_a.data(),
            pose_b.data(), scale_a.data(), scale_b.data()};
  }

  std::vector<std::uint32_t> a, b;
  std::vector<Pose> pose_a, pose_b;
  std::vector<double> scale_a, scale_b;
};

}  // namespace ist::testing
