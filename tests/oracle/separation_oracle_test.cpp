#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <vector>

#include "support/oracle_assets.h"

namespace ist {
namespace {

/// The exact distance of the solids lies in the interval on every row, and more spheres narrow it.
TEST(SeparationOracle, IntervalsHoldTheSolidsDistance) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  Workspace workspace;
  double last_width = 1;
  for (const std::size_t spheres : {300u, 1500u}) {
    std::vector<double> widths;
    for (const testing::OracleRow& row : testing::read_oracle_rows("eledino")) {
      const auto [a, b] = testing::placed(row, spheres);
      const Separation answer = separation(a, b, {.inner_spheres = true}, workspace);
      const double exact = row.solid_distance();
      ASSERT_EQ(answer.status, QueryStatus::ok);
      EXPECT_LE(answer.distance_min, exact) << "row " << row.id << ", " << spheres;
      EXPECT_GE(answer.distance_max, exact) << "row " << row.id << ", " << spheres;
      if (row.pose_class == "sep") widths.push_back(answer.distance_max - answer.distance_min);
      if (answer.distance > 0) {
        EXPECT_NEAR((answer.point_b - answer.point_a).norm(), answer.distance, 1e-9);
        EXPECT_NEAR(answer.normal.norm(), 1, 1e-12);
      }
    }
    std::nth_element(widths.begin(), widths.begin() + widths.size() / 2, widths.end());
    const double median = widths[widths.size() / 2];
    RecordProperty("median_width_" + std::to_string(spheres), std::to_string(median));
    EXPECT_LE(median, 0.7 * last_width) << spheres;
    last_width = median;
  }
  EXPECT_LE(last_width, 0.03);
}

/// The distance of the surfaces, to the oracle's digits.
TEST(SeparationOracle, SurfacesAreAtTheSolidsDistance) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  Workspace workspace;
  for (const char* const key : {"eledino", "ico1k"})
    for (const testing::OracleRow& row : testing::read_oracle_rows(key)) {
      const auto [a, b] = testing::placed(row, 300);
      const Separation answer = separation(a, b, {}, workspace);
      ASSERT_EQ(answer.status, QueryStatus::ok);
      EXPECT_NEAR(answer.distance, row.solid_distance(), 1e-9 * row.solid_distance())
          << key << " row " << row.id;
      EXPECT_LE(answer.distance_max - answer.distance_min, 1e-11);
    }
}

}  // namespace
}  // namespace ist
