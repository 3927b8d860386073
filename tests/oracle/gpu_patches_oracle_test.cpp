#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>

#include "support/host_patches.h"
#include "support/oracle_assets.h"

namespace ist::testing {
namespace {

/// The GPU's batch on the host: every row's patches are the CPU's.
TEST(GpuPatchesOracle, AreThoseOfTheCpu) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  Workspace workspace;
  ContactSettings settings;
  settings.spheres_only = true;
  constexpr std::uint32_t kMost = 8;
  for (const std::string key : {"eledino", "ico1k"}) {  // spheres do not know the size of a mesh
    constexpr std::size_t kSpheres = 1500;
    const std::vector<OracleRow> rows = read_oracle_rows(key);
    std::vector<BatchPair> pairs;
    for (const OracleRow& row : rows) pairs.push_back({0, 1, {}, row.pose, 1, row.scale_b});
    const auto [first, second] = placed(rows.front(), kSpheres);
    const std::vector<PatchedPair> answers =
        HostPatches({first.asset, second.asset}).run(pairs, Measure::matched, kMost);
    double worst = 0, worst_force = 0;
    std::size_t found = 0, in_touch = 0, other = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto [a, b] = placed(rows[i], kSpheres);
      ContactPatch patches[kMost];
      const ContactPatches cpu = contact_patches(a, b, settings, workspace, patches);
      const PatchedPair& gpu = answers[i];
      ASSERT_EQ(gpu.whole.status, QueryStatus::ok);
      EXPECT_NEAR(gpu.whole.volume, cpu.penetration.volume, 1e-5 * cpu.penetration.volume);
      if (cpu.count == 0) {
        EXPECT_TRUE(gpu.patches.empty()) << key << " row " << rows[i].id;
        continue;
      }
      ++in_touch;
      if (!std::equal(gpu.patches.begin(), gpu.patches.end(), patches, patches + cpu.count,
                      [](const auto& x, const auto& y) { return x.id == y.id; })) {
        ++other;
        continue;
      }
      found += cpu.count;
      for (std::size_t k = 0; k < cpu.count; ++k) {
        const ContactPatch &x = gpu.patches[k], &y = patches[k];
        worst = std::max(worst, std::abs(x.volume / y.volume - 1));
        worst_force = std::max(
            worst_force, (x.force - y.force).norm() / (y.area + std::cbrt(y.volume * y.volume)));
        EXPECT_EQ(x.area > 0, y.area > 0) << key << " row " << rows[i].id;
      }
    }
    std::printf(
        "%s: %zu patches of %zu contacts, %zu of other regions, volumes differ by up to %.2g, "
        "forces by %.2g\n",
        key.c_str(), found, in_touch, other, worst, worst_force);
    EXPECT_EQ(other, 0u) << key;
    EXPECT_LE(worst, 1e-4) << key;
    EXPECT_LE(worst_force, 1e-4) << key;
  }
}

}  // namespace
}  // namespace ist::testing
