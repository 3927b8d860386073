#include <gtest/gtest.h>
#include <ist/query.h>

#include "support/host_separations.h"
#include "support/oracle_assets.h"

namespace ist::testing {
namespace {

/// The GPU's batch on the host: every row's solids, their exact distance and the CPU's answer.
TEST(GpuSeparationOracle, AnswersAreTheSolidsDistance) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  Workspace workspace;
  for (const std::string key : {"eledino", "ico1k"}) {
    constexpr std::size_t kSpheres = 1500;
    const std::vector<OracleRow> rows = read_oracle_rows(key);
    std::vector<BatchPair> pairs;
    for (const OracleRow& row : rows) pairs.push_back({0, 1, {}, row.pose, 1, row.scale_b});
    const auto [first, second] = placed(rows.front(), kSpheres);
    HostSeparations batch({first.asset, second.asset});
    const std::vector<Separation> answers = batch.run(pairs);
    double worst = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto [a, b] = placed(rows[i], kSpheres);
      ASSERT_EQ(&a.asset.header(), &first.asset.header());
      ASSERT_EQ(&b.asset.header(), &second.asset.header());
      const Separation cpu = separation(a, b, {}, workspace);
      const Separation& gpu = answers[i];
      const double exact = rows[i].solid_distance();
      ASSERT_EQ(gpu.status, QueryStatus::ok);
      EXPECT_NEAR(gpu.distance, exact, 1e-9 * exact) << key << " row " << rows[i].id;
      EXPECT_LE(gpu.distance_min, cpu.distance) << key << " row " << rows[i].id;
      EXPECT_GE(gpu.distance_max, cpu.distance) << key << " row " << rows[i].id;
      EXPECT_NEAR(gpu.distance, cpu.distance, 1e-9 * cpu.distance) << key << " row " << rows[i].id;
      if (cpu.distance > 0) worst = std::max(worst, std::abs(gpu.distance / cpu.distance - 1));
    }
    std::printf("%s: %zu rows, distances differ by up to %.2g\n", key.c_str(), rows.size(), worst);
  }
}

}  // namespace
}  // namespace ist::testing
