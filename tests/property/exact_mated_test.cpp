#include <gtest/gtest.h>

#include "support/mate_checks.h"

// Exact queries of random mates, whose volumes and contact areas follow from plane geometry. The
// soak has a million of them.

namespace ist {
namespace {

TEST(ExactMated, RandomMates) {
  testing::MateChecks checks(1);
  for (int i = 0; i < 1500; ++i) checks.run(i % 8 == 0 ? 60 : 12);
  const testing::MateTally& tally = checks.tally();
  EXPECT_GE(tally.queries, 10'000u);
  EXPECT_GE(tally.touching, 1000u);
  for (const auto& [what, count] : tally.wrong) EXPECT_EQ(count, 0u) << what;
  const testing::MateWork work = checks.work();
  EXPECT_LE(work.worst, 10) << work.what;
}

}  // namespace
}  // namespace ist
