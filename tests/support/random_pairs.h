#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <type_traits>
#include <utility>
#include <vector>

#include "query/base/members.h"
#include "support/baked.h"
#include "support/host_batch.h"
#include "support/patch_columns.h"
#include "support/test_meshes.h"

namespace ist::testing {

/// Solids of like and unlike sizes of spheres.
inline const std::vector<Asset>& batch_assets() {
  static const std::vector<Asset> made = [] {
    std::vector<Asset> out;
    out.push_back(baked(torus_mesh(1, 0.4, 48, 24), "torus", 1500, false));
    out.push_back(baked(icosphere_mesh(3), "ball", 300, false));
    out.push_back(baked(cube_mesh(), "cube", 40, false));
    out.push_back(baked(cube_mesh(), "cube", 10, false));
    return out;
  }();
  return made;
}

inline std::vector<GpuSolid> batch_solids() {
  std::vector<GpuSolid> out;
  for (const Asset& asset : batch_assets()) out.emplace_back(asset.view());
  return out;
}

/// Pairs of them, the same for a seed on every machine.
class RandomPairs {
 public:
  explicit RandomPairs(unsigned seed) : random_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  Pose pose(double reach) {
    Eigen::Quaterniond q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    q.normalize();
    return {{q.w(), q.x(), q.y(), q.z()},
            {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)}};
  }
  std::uint32_t asset() { return static_cast<std::uint32_t>(random_() % batch_assets().size()); }

  /// Pairs of solids of like and unlike sizes; most of them overlap.
  std::vector<BatchPair> pairs(std::size_t count) {
    std::vector<BatchPair> out;
    for (std::size_t k = 0; k < count; ++k) {
      BatchPair pair = {asset(), asset(), pose(0.2), pose(0.8), uniform(0.8, 1.2), 1};
      pair.scale_b = std::exp(uniform(-3, 0.5));
      out.push_back(pair);
    }
    return out;
  }

  /// Pairs of solids that are apart, near, touching and overlapping.
  std::vector<BatchPair> pairs_at_all_distances(std::size_t count) {
    std::vector<BatchPair> out = pairs(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double far = std::exp(uniform(0, 2.5));
      if (i % 4 != 0)
        for (double& t : out[i].pose_b.t) t *= far;
    }
    return out;
  }

 private:
  std::mt19937_64 random_;
};

inline std::pair<PlacedAsset, PlacedAsset> placed(const BatchPair& pair) {
  return {PlacedAsset{batch_assets()[pair.a].view(), pair.pose_a, pair.scale_a},
          PlacedAsset{batch_assets()[pair.b].view(), pair.pose_b, pair.scale_b}};
}

/// NaN is like NaN.
template <class Answer>
void expect_same_answer(const Answer& x, const Answer& y, std::size_t i) {
  for_each_member(
      [i]<class Value>(const Value& one, const Value& other) {
        bool same = one == other;
        if constexpr (std::is_same_v<Value, double>) same |= std::isnan(one) && std::isnan(other);
        if constexpr (std::is_same_v<Value, Eigen::Vector3d>)
          same |= one.array().isNaN().all() && other.array().isNaN().all();
        EXPECT_TRUE(same) << i << ": " << ::testing::PrintToString(one) << " is not "
                          << ::testing::PrintToString(other);
      },
      x, y);
}

template <class Answer>
void expect_same_bits(const std::vector<Answer>& x, const std::vector<Answer>& y) {
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t i = 0; i < x.size(); ++i) expect_same_answer(x[i], y[i], i);
}

inline void expect_same_bits(const std::vector<PatchedPair>& x, const std::vector<PatchedPair>& y) {
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    expect_same_answer(x[i].whole, y[i].whole, i);
    ASSERT_EQ(x[i].patches.size(), y[i].patches.size()) << i;
    for (std::size_t k = 0; k < x[i].patches.size(); ++k)
      expect_same_answer(x[i].patches[k], y[i].patches[k], i);
  }
}

}  // namespace ist::testing
