#include <gtest/gtest.h>
#include <ist/query.h>

#include <hwy/highway.h>

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "support/answer_bits.h"
#include "support/query_settings.h"
#include "support/random_assets.h"

namespace ist {
namespace {

using testing::AnswerBits;
using testing::make_random_asset;

constexpr const char* kTable = IST_SOURCE_DIR "/tests/unit/query_hashes.csv";

/// One line of the table: hash of the bits of many answers about two assets, on any machine.
struct Row {
  std::string a, b, asked, hash;
};

std::vector<Row> read_table() {
  std::ifstream file(kTable);
  std::string line;
  std::getline(file, line);  // names of the columns
  std::vector<Row> rows;
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    Row row;
    for (std::string* const field : {&row.a, &row.b, &row.asked, &row.hash})
      std::getline(fields, *field, ',');
    rows.push_back(row);
  }
  return rows;
}

const Asset& asset_named(const std::string& name) {
  static const std::map<std::string, Asset> assets = [] {
    std::map<std::string, Asset> made;
    made.emplace("fine", make_random_asset({900, 0.1, {}, 0, 2}, 1));
    made.emplace("coarse", make_random_asset({400, 0.3, {}, 0, 1}, 2));
    made.emplace("off_centre", make_random_asset({200, 0.01, {3, -2, 1}, 1, 0}, 3));
    return made;
  }();
  return assets.at(name);
}

/// Random poses of the same bits everywhere: the C library's functions differ in the last one.
class Poses {
 public:
  Pose next(double distance) {
    Pose pose;
    for (double& q : pose.q) q = unit();
    const double norm = std::sqrt((pose.q[0] * pose.q[0] + pose.q[1] * pose.q[1]) +
                                  (pose.q[2] * pose.q[2] + pose.q[3] * pose.q[3]));
    for (double& q : pose.q) q /= norm;
    for (double& t : pose.t) t = distance * unit();
    return pose;
  }

 private:
  /// In [−1, 1).
  double unit() { return static_cast<double>(random_() >> 11) * 0x1p-52 - 1; }
  std::mt19937_64 random_{3};
};

void ask(const std::string& asked, const PlacedTree& a, const PlacedTree& b, Workspace& workspace,
         AnswerBits& bits) {
  PenetrationSettings settings;
  if (asked == "inner") settings.measure = Measure::inner;
  if (asked == "max_visits") settings.max_visits = 50;
  if (asked == "pair_budget") settings.pair_budget = 300;
  if (asked == "relative_error") settings.relative_error = 0.01;
  if (asked == "contact_patches") {
    ContactPatch patches[6];
    const ContactPatches answer =
        contact_patches(a, b, testing::for_contacts(settings), workspace, patches);
    bits.add(answer.penetration);
    for (std::size_t i = 0; i < answer.count; ++i) bits.add(patches[i]);
    return;
  }
  const PenetrationAndSeparation both = query(a, b, testing::for_both(settings), workspace);
  bits.add(both.penetration);
  bits.add(both.separation);
  if (asked == "matched") bits.add(without_protrusion(both.penetration, a, b));
}

std::string hash_of(const Row& row) {
  const Asset& a = asset_named(row.a);
  std::uint64_t hash = a.view().header().content_hash;
  if (row.asked != "asset") {
    const Asset& b = asset_named(row.b);
    Poses poses;
    Workspace workspace;
    AnswerBits bits;
    for (int i = 0; i < 60; ++i) {
      const double scale = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.3 : 0.001;
      const PlacedTree pa{a.view(), poses.next(0.1), 1.0};
      const PlacedTree pb{b.view(), poses.next(0.03 * i), scale};
      ask(row.asked, pa, pb, workspace, bits);
    }
    hash = bits.value();
  }
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, hash);
  return text;
}

void compare_with_table(const std::string& where) {
  for (const Row& row : read_table())
    EXPECT_EQ(hash_of(row), row.hash) << where << ": " << row.a << ',' << row.b << ',' << row.asked;
}

TEST(InstructionSets, GiveTheBitsOfTheTable) {
  ASSERT_FALSE(read_table().empty()) << kTable;
  compare_with_table("as chosen");
  int levels = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    compare_with_table(hwy::TargetName(target));
    ++levels;
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GE(levels, 1);
}

}  // namespace
}  // namespace ist
