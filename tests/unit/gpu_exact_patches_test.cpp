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

/// Legs on a plate, teeth in a block whose sides are single triangles, a cavity in the overlap.
struct ManyParts {
  std::vector<Asset> assets;
  std::vector<BatchPair> pairs;

  ManyParts() {
    TriangleMesh legs, holes = box_mesh({-3, -3, -3}, {3, 3, 3});
    for (int x = 0; x < 6; ++x)
      for (int y = 0; y < 6; ++y) {
        const double side = 0.1 + 0.01 * x + 0.003 * y;
        const Eigen::Vector3d at(0.3 * x - 0.9, 0.3 * y - 0.9, 0);
        const TriangleMesh leg = box_mesh(at, at + Eigen::Vector3d(side, side, 1));
        legs = legs.triangles.empty() ? leg : joined(legs, leg);
      }
    TriangleMesh inner = box_mesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
    for (auto& t : inner.triangles) std::swap(t[0], t[1]);
    assets.push_back(surface(box_mesh({-2, -2, -1}, {2, 2, 0}), "plate"));
    assets.push_back(surface(legs, "legs"));
    assets.push_back(surface(joined(holes, inner), "hollow"));
    const auto add = [&](std::uint32_t a, std::uint32_t b, double x, double y, double z) {
      BatchPair pair;
      pair.a = a;
      pair.b = b;
      for (int k = 0; k < 3; ++k) pair.pose_b.t[k] = k == 0 ? x : k == 1 ? y : z;
      pairs.push_back(pair);
    };
    for (const double down : {-0.1, -1e-9, 0.0, -0.95}) add(0, 1, 0.01, 0.02, down);
    add(1, 0, 0.01, 0.02, 0.1);  // exchanged
    add(2, 1, 0.1, 0.1, 2.9);    // into a side of two triangles
    add(0, 2, 0, 0, 2.9);
    add(2, 0, 0, 0, 0.2);  // a cavity's wall
    add(2, 2, 0, 0, 0);
    add(2, 2, 0.1, 0, 0);
    add(1, 1, 0.15, 0, 0);
    for (BatchPair turned : std::vector(pairs)) {
      turned.pose_b.q[0] = 0.99;
      turned.pose_b.q[2] = 0.01;
      pairs.push_back(turned);
    }
  }
};

TEST(GpuExactPatches, OfManyPartsAreTheCpus) {
  const ManyParts many;
  for (const std::uint32_t most : {1u, 2u, 4u, 16u, kMostGpuPatches}) {
    const PatchDifferences worst = ask(many.assets, many.pairs, most);
    EXPECT_GE(worst.patches, 10 * most);
  }
}

/// Results must not depend on which lane does what, and when.
TEST(GpuExactPatches, LanesOfAWarpNeedNoLuck) {
  const ManyParts many;
  const MatedBatch mated(64, 6);
  std::vector<BatchPair> pairs = exact_pairs(65, 30);
  for (const BatchPair& pair : aligned_pairs(66, 30)) pairs.push_back(pair);
  for (const auto& [assets, asked] :
       {std::pair(&exact_assets(), &std::as_const(pairs)), std::pair(&mated.assets, &mated.pairs),
        std::pair(&many.assets, &many.pairs)}) {
    HostPatches batch(views_of(*assets));
    const std::vector<PatchedPair> expected = batch.run(*asked, Measure::exact, 8, 1);
    expect_near(compare_patches(*assets, *asked, expected, 8));
    expect_same_bits(batch.run(*asked, Measure::exact, 8, 2), expected);
  }
}

/// The whole is that of a batch of penetrations; without patches it is the only result.
TEST(GpuExactPatches, WholesAreThoseOfPenetrations) {
  const std::vector<BatchPair> pairs = aligned_pairs(67, 200);
  const std::vector<Penetration> expected = HostBatch(exact_solids()).run(pairs, Measure::exact);
  for (const std::uint32_t most : {0u, 4u}) {
    std::vector<Penetration> wholes;
    for (const PatchedPair& pair : HostPatches(exact_solids()).run(pairs, Measure::exact, most)) {
      wholes.push_back(pair.whole);
      EXPECT_LE(pair.patches.size(), most);
    }
    expect_same_bits(wholes, expected);
  }
}

/// The second pass answers pairs that do not fit into the first; pairs that fit into none are
/// reported.
TEST(GpuExactPatches, LittleMemoryDoesNotShow) {
  std::vector<BatchPair> pairs = exact_pairs(68, 100);
  for (const BatchPair& pair : aligned_pairs(69, 100)) pairs.push_back(pair);
  HostPatches batch(exact_solids());
  const std::vector<PatchedPair> expected = batch.run(pairs, Measure::exact, 6);
  std::uint32_t before = batch.exact_counters.listed[2];
  for (const std::ptrdiff_t bytes : {100'000, 30'000, 12'000, 5'000, 100}) {
    batch.part_bytes[1] = bytes;
    expect_same_bits(batch.run(pairs, Measure::exact, 6), expected);
    EXPECT_GT(batch.exact_counters.listed[2], before) << bytes;
    before = batch.exact_counters.listed[2];
  }
  batch.part_bytes[2] = 60'000;
  std::size_t lack = 0;
  const std::vector<PatchedPair> found = batch.run(pairs, Measure::exact, 6);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (found[i].whole.status == QueryStatus::ok) {
      expect_same_bits({found[i]}, {expected[i]});
      continue;
    }
    ++lack;
    EXPECT_EQ(found[i].whole.status, QueryStatus::budget_exhausted);
    EXPECT_TRUE(std::isnan(found[i].whole.volume) && std::isnan(found[i].whole.contact_area));
    EXPECT_TRUE(found[i].patches.empty());
  }
  EXPECT_GT(lack, 20u);
  EXPECT_LT(lack, pairs.size() / 2);
}

TEST(GpuExactPatches, WhatCannotBeAskedSaysSo) {
  std::vector<GpuSolid> solids = exact_solids();
  solids.emplace_back(batch_assets()[0].view());  // keeps no mesh
  solids.emplace_back(Shape(BallShape{1}));
  std::vector<BatchPair> pairs = exact_pairs(70, 4);
  pairs[0].b = 5;
  pairs[1].a = 6;
  pairs[2].b = 7;
  pairs[3].pose_b.t[1] = std::nan("");
  constexpr QueryStatus kNot = QueryStatus::missing_data, kInvalid = QueryStatus::invalid_input;
  const std::vector<PatchedPair> found = HostPatches(solids).run(pairs, Measure::exact, 3);
  for (const auto& [i, status] : {std::pair{0, kNot}, {1, kNot}, {2, kInvalid}, {3, kInvalid}}) {
    EXPECT_EQ(found[static_cast<std::size_t>(i)].whole.status, status);
    EXPECT_TRUE(std::isnan(found[static_cast<std::size_t>(i)].whole.volume));
    EXPECT_TRUE(found[static_cast<std::size_t>(i)].patches.empty());
  }
}

}  // namespace
}  // namespace ist::testing
