#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/exact_patch_checks.h"
#include "support/host_patches.h"

// The GPU's batch of exact contact patches, its source run by teams of the host: of one lane, and
// of 32 that go on in an order that nobody can count on.

namespace ist::testing {
namespace {

PatchDifferences ask(const std::vector<Asset>& assets, const std::vector<BatchPair>& pairs,
                     std::uint32_t most) {
  HostPatches batch(views_of(assets));
  const PatchDifferences worst =
      compare_patches(assets, pairs, batch.run(pairs, Measure::exact, most), most);
  expect_near(worst);
  return worst;
}

TEST(GpuExactPatches, AreTheCpus) {
  const std::vector<BatchPair> pairs = exact_pairs(61, 400);
  for (const std::uint32_t most : {1u, 2u, 4u, 16u}) {
    const PatchDifferences worst = ask(exact_assets(), pairs, most);
    EXPECT_GT(worst.patches, 200u);
    EXPECT_EQ(worst.several > 20, most > 1);
  }
}

TEST(GpuExactPatches, AlignedOnesAreTheCpus) {
  const std::vector<BatchPair> pairs = aligned_pairs(62, 400);
  for (const std::uint32_t most : {1u, 2u, 4u, 16u}) {
    const PatchDifferences worst = ask(exact_assets(), pairs, most);
    EXPECT_GT(worst.touching, 10u);
  }
}

TEST(GpuExactPatches, OfMatesAreTheCpus) {
  const MatedBatch mated(63, 200);
  for (const std::uint32_t most : {1u, 2u, 4u, 16u}) {
    const PatchDifferences worst = ask(mated.assets, mated.pairs, most);
    EXPECT_GT(worst.touching, 50u);
  }
}

TEST(GpuExactPatches, WhatGrazesIsTheCpus) { ask(exact_assets(), grazing_pairs(), 4); }

}  // namespace
}  // namespace ist::testing
