#pragma once

#include <gtest/gtest.h>
#include <ist/bake.h>

#include <cstring>

namespace ist::testing {

/// Two packings are the same: the spheres bit for bit, and all that is said of them.
inline void expect_same(const SpherePacking& a, const SpherePacking& b) {
  ASSERT_EQ(a.spheres.size(), b.spheres.size());
  for (std::size_t i = 0; i < a.spheres.size(); ++i)
    ASSERT_EQ(std::memcmp(&a.spheres[i], &b.spheres[i], sizeof(Sphere)), 0) << "sphere " << i;
  EXPECT_EQ(a.stop, b.stop);
  EXPECT_EQ(a.rounds, b.rounds);
  EXPECT_EQ(a.coverage, b.coverage);
  EXPECT_EQ(a.kept_ratio_worst, b.kept_ratio_worst);
  EXPECT_EQ(a.kept_ratio_median, b.kept_ratio_median);
}

/// The spheres of a packing that was cut short are the first of the whole, bit for bit.
inline void expect_prefix(const SpherePacking& cut, const SpherePacking& whole) {
  ASSERT_LE(cut.spheres.size(), whole.spheres.size());
  for (std::size_t i = 0; i < cut.spheres.size(); ++i)
    ASSERT_EQ(std::memcmp(&cut.spheres[i], &whole.spheres[i], sizeof(Sphere)), 0) << "sphere " << i;
}

}  // namespace ist::testing
