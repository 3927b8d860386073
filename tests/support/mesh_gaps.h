#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <ist/gpu_query.h>
#include <ist/query.h>

#include "support/exact_batches.h"

// Comparison of batches of separations of meshes with the CPU.

namespace ist::testing {

/// Pairs at all distances: of those that would meet three of four are pulled apart.
inline std::vector<BatchPair> mesh_gap_pairs(unsigned seed, std::size_t count) {
  RandomPairs random(seed);
  std::vector<BatchPair> pairs = exact_pairs(seed, count);
  for (std::size_t i = 0; i < count; ++i) {
    const double far = std::exp(random.uniform(0, 2.5));
    if (i % 4 != 0)
      for (double& t : pairs[i].pose_b.t) t *= far;
  }
  return pairs;
}

/// Flush, touching, nested and copied, in place and along an axis.
inline std::vector<BatchPair> aligned_gap_pairs(unsigned seed, std::size_t count) {
  RandomPairs random(seed);
  std::vector<BatchPair> pairs = aligned_pairs(seed, count);
  for (std::size_t i = 0; i < count; ++i)
    if (i % 2 == 0)
      pairs[i].pose_b.t[static_cast<int>(random.uniform(0, 3))] =
          std::ldexp(1, static_cast<int>(i / 2 % 4));
  return pairs;
}

struct GapDifferences {
  double distance = 0;  ///< relative
  std::size_t apart = 0, farther = 0, other_points = 0;
};

/// From the CPU's answers.
inline GapDifferences compare_gaps(const std::vector<Asset>& assets,
                                   const std::vector<BatchPair>& pairs,
                                   const std::vector<Separation>& answers,
                                   double max_distance = 0) {
  GapDifferences out;
  Workspace workspace;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const BatchPair& pair = pairs[i];
    const PlacedAsset a = {assets[pair.a].view(), pair.pose_a, pair.scale_a};
    const PlacedAsset b = {assets[pair.b].view(), pair.pose_b, pair.scale_b};
    SeparationSettings settings;
    settings.max_distance = max_distance;
    const Separation cpu = separation(a, b, settings, workspace), &gpu = answers[i];
    EXPECT_EQ(gpu.status, cpu.status) << i;
    if (cpu.status != QueryStatus::ok) {
      EXPECT_TRUE(std::isnan(gpu.distance)) << i;
      continue;
    }
    if (std::isinf(cpu.distance_max)) {
      ++out.farther;
      EXPECT_EQ(gpu.distance, cpu.distance) << i;
      EXPECT_EQ(gpu.distance_min, cpu.distance_min) << i;
      EXPECT_TRUE(std::isinf(gpu.distance_max) && gpu.point_a.hasNaN() && gpu.normal.hasNaN()) << i;
      continue;
    }
    // Next to touch a rounding of the poses is more than a part of the distance.
    const double size = size_of(a) + size_of(b);
    EXPECT_EQ(gpu.distance == 0, cpu.distance == 0)
        << i << ": " << gpu.distance << " " << cpu.distance;
    if (cpu.distance == 0 || gpu.distance == 0) {
      EXPECT_EQ(gpu.distance_min, 0) << i;
      continue;
    }
    ++out.apart;
    const double off = std::abs(gpu.distance - cpu.distance);
    EXPECT_LE(off, std::max(1e-9 * cpu.distance, 1e-13 * size)) << i;
    if (off > 1e-15 * size) out.distance = std::max(out.distance, off / cpu.distance);
    // Far apart for their size one of those that are as near answers: either interval holds the
    // truth.
    EXPECT_LE(gpu.distance_min, std::min(gpu.distance, cpu.distance_max)) << i;
    EXPECT_GE(gpu.distance_max, std::max(gpu.distance, cpu.distance_min)) << i;
    EXPECT_LE(gpu.distance_max - gpu.distance_min,
              2 * (cpu.distance_max - cpu.distance_min) + 1e-15 * size)
        << i;
    EXPECT_NEAR(gpu.normal.norm(), 1, 1e-12) << i;
    EXPECT_LE((gpu.point_b - gpu.point_a - gpu.distance * gpu.normal).norm(),
              1e-12 * (size + cpu.distance))
        << i;
    out.other_points += (gpu.point_a - cpu.point_a).norm() > 1e-9 * size;
  }
  std::printf("%zu apart, %zu farther; distances differ by %.2g; %zu other points\n", out.apart,
              out.farther, out.distance, out.other_points);
  return out;
}

}  // namespace ist::testing
