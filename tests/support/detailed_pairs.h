#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "support/random_assets.h"
#include "support/random_pairs.h"

namespace ist::testing {

/// Assets with one to four levels; the last has the bytes of the first.
inline const std::vector<Asset>& detailed_assets() {
  static const std::vector<Asset> made = [] {
    std::vector<Asset> out;
    out.push_back(make_random_asset({6000, 0.3, {0.1, -0.2, 0.3}, 1, 3}, 1));
    out.push_back(make_random_asset({3000, 0.2, {0, 0, 0}, 0, 2}, 2));
    out.push_back(make_random_asset({400, 0.5, {0, 0, 0}, 0, 0}, 3));
    out.push_back(baked(torus_mesh(1, 0.4, 48, 24), "torus", 1500, false));
    out.push_back(make_random_asset({6000, 0.3, {0.1, -0.2, 0.3}, 1, 3}, 1));
    return out;
  }();
  return made;
}

inline std::vector<GpuSolid> detailed_solids() {
  std::vector<GpuSolid> out;
  for (const Asset& asset : detailed_assets()) out.emplace_back(asset.view());
  return out;
}

/// Pairs of them that meet more often than not.
inline std::vector<BatchPair> detailed_pairs(std::size_t count, unsigned seed) {
  RandomPairs random(seed);
  std::vector<BatchPair> out;
  for (std::size_t k = 0; k < count; ++k) {
    BatchPair pair;
    pair.a = static_cast<std::uint32_t>(random.uniform(0, 4));
    pair.b = static_cast<std::uint32_t>(random.uniform(0, 4));
    pair.scale_a = random.uniform(0.8, 1.2);
    pair.scale_b = std::exp(random.uniform(-2, 0.3));
    pair.pose_a = random.pose(0.3);
    pair.pose_b = random.pose(1.8);
    out.push_back(pair);
  }
  return out;
}

/// Copies at nearly the same pose, some exactly there.
inline std::vector<BatchPair> copies_in_place(std::size_t count, unsigned seed) {
  RandomPairs random(seed);
  std::vector<BatchPair> out;
  for (std::size_t k = 0; k < count; ++k) {
    BatchPair pair;
    pair.a = static_cast<std::uint32_t>(k % 4);
    pair.b = pair.a == 0 && k % 8 == 0 ? 4 : pair.a;
    pair.pose_a = pair.pose_b = random.pose(0.5);
    pair.scale_a = pair.scale_b = 0.9;
    const double change = k < 8 ? 0 : 0.06 * random.uniform(0, 1);
    for (double& t : pair.pose_b.t) t += change * random.uniform(-1, 1);
    Eigen::Quaterniond q(pair.pose_b.q[0], pair.pose_b.q[1], pair.pose_b.q[2], pair.pose_b.q[3]);
    q = Eigen::AngleAxisd(change, Eigen::Vector3d::UnitX()) * q;
    const double turned[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy(turned, turned + 4, pair.pose_b.q);
    if (k % 3 == 0) pair.scale_b *= 1 + 0.5 * change;
    out.push_back(pair);
  }
  return out;
}

}  // namespace ist::testing
