#include <gtest/gtest.h>
#include <ist/query.h>

#include "support/oracle_assets.h"
#include "support/oracle_rows.h"

namespace ist {
namespace {

/// Never yes where the exact volume is 0, never no where it is not; and seldom unknown.
TEST(OverlapOracle, IsNeverWrong) {
  IST_NEEDS_SHARED("oracle/poses");
  Workspace workspace;
  for (const std::string key : {"eledino", "ico1k"}) {
    int unknown = 0, rows = 0;
    for (const testing::OracleRow& row : testing::read_oracle_rows(key)) {
      const auto [a, b] = testing::placed(row, 1500);
      const YesNo answer = overlap(a, b, workspace).answer;
      EXPECT_NE(answer, row.volume > 0 ? YesNo::no : YesNo::yes) << key << " " << row.id;
      unknown += answer == YesNo::unknown;
      ++rows;
    }
    EXPECT_LE(unknown, rows / 20) << key;
  }
}

}  // namespace
}  // namespace ist
