#include "support/extremes.h"

#include <gtest/gtest.h>

// Every promise that benchmarks/results/extremes.md makes.

namespace ist {
namespace {

class Extremes : public ::testing::TestWithParam<testing::Extreme> {};

TEST_P(Extremes, PromisesAreKept) {
  for (const testing::Claim& claim : GetParam().claims())
    EXPECT_TRUE(claim.is_kept()) << claim.what << ": " << claim.worst << ", promised ≤ "
                                 << claim.limit;
}

INSTANTIATE_TEST_SUITE_P(Property, Extremes, ::testing::ValuesIn(testing::extremes()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace ist
