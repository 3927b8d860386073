#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include <ist/query.h>

#include "support/random_pairs.h"

namespace ist::testing {

/// A pair's contact, whole and in patches.
struct PatchedPair {
  Penetration whole;
  std::vector<ContactPatch> patches;
};

/// A batch's patches, an array each.
struct PatchColumns {
  std::uint32_t most;
  std::vector<std::uint32_t> count;
  std::vector<std::uint64_t> id;
  std::vector<double> centroid, normal, area, depth, volume, force, torque;

  std::vector<PatchedPair> rows(const std::vector<Penetration>& wholes) const {
    const auto vector = [](const std::vector<double>& from, std::size_t i) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    std::vector<PatchedPair> out(wholes.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].whole = wholes[i];
      for (std::size_t k = i * most; k < i * most + count[i]; ++k)
        out[i].patches.push_back({id[k], vector(centroid, k), vector(normal, k), area[k], depth[k],
                                  volume[k], vector(force, k), vector(torque, k)});
    }
    return out;
  }
};

inline void expect_same_bits(const std::vector<PatchedPair>& x, const std::vector<PatchedPair>& y) {
  ASSERT_EQ(x.size(), y.size());
  std::vector<Penetration> wholes[2];
  for (std::size_t i = 0; i < x.size(); ++i) {
    wholes[0].push_back(x[i].whole);
    wholes[1].push_back(y[i].whole);
    ASSERT_EQ(x[i].patches.size(), y[i].patches.size()) << i;
    for (std::size_t k = 0; k < x[i].patches.size(); ++k) {
      const ContactPatch &p = x[i].patches[k], &q = y[i].patches[k];
      EXPECT_EQ(p.id, q.id) << i;
      EXPECT_EQ(p.centroid, q.centroid) << i;
      EXPECT_EQ(p.normal, q.normal) << i;
      EXPECT_EQ(p.area, q.area) << i;
      EXPECT_EQ(p.depth, q.depth) << i;
      EXPECT_EQ(p.volume, q.volume) << i;
      EXPECT_EQ(p.force, q.force) << i;
      EXPECT_EQ(p.torque, q.torque) << i;
    }
  }
  expect_same_bits(wholes[0], wholes[1]);
}

}  // namespace ist::testing
