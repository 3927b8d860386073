#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>

#include <hwy/highway.h>

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "support/answer_bits.h"
#include "support/query_settings.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

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
    // With fields: of corners that no function of the C library has touched.
    const auto add_baked = [&](const char* baked, TriangleMesh mesh, std::size_t spheres) {
      PackingSettings settings;
      settings.max_spheres = spheres;
      made.emplace(baked, bake(close_mesh(std::move(mesh), baked), settings));
    };
    add_baked("box", testing::box_mesh({-1, -0.5, -0.25}, {1, 0.5, 0.25}), 300);
    add_baked("ball", testing::icosphere_mesh(2), 60);
    return made;
  }();
  return assets.at(name);
}

/// A field by the name that a row has in place of its first asset.
Shape field_named(const std::string& name) {
  const auto numbers_of = [](float sign) {
    std::vector<float> made(343);
    for (std::size_t i = 0; i < made.size(); ++i)
      made[i] = sign * (0.125f - 0.0625f * static_cast<float>(i * 7 % 11));
    return made;
  };
  static const std::vector<float> heights = numbers_of(1), distances = numbers_of(-1);
  if (name == "half_space") return HalfSpaceShape{{0.6, 0, 0.8}, 0.1};
  if (name == "box_field") return BoxShape{{0.7, 0.5, 0.01}};
  if (name == "ball_field") return BallShape{0.8};
  if (name == "capsule") return CapsuleShape{0.4, 0.5};
  if (name == "cylinder") return CylinderShape{0.5, 0.4};
  if (name == "terrain") {
    HeightFieldShape field;
    field.heights = heights.data();
    field.columns = field.rows = 7;
    field.spacing[0] = field.spacing[1] = 0.25;
    return field;
  }
  DistanceGridShape field;
  field.distances = distances.data();
  for (std::uint32_t& n : field.size) n = 7;
  field.origin = Eigen::Vector3d::Constant(-0.75);
  field.spacing = 0.25;
  return field;
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

/// `A`: a placed tree or a placed field.
template <class A>
void ask(const std::string& asked, const A& a, const PlacedAsset& b, Workspace& workspace,
         AnswerBits& bits) {
  PenetrationSettings settings;
  if constexpr (std::is_same_v<A, PlacedAsset>)
    if (asked == "exact") {
      settings.measure = Measure::exact;
      bits.add(penetration(a, b, settings, workspace));
      return;
    }
  if (asked == "spheres_only") settings.spheres_only = true;
  if (asked == "inner") settings.measure = Measure::inner;
  if (asked == "max_visits") settings.max_visits = 50;
  if (asked == "pair_budget") settings.pair_budget = 300;
  if (asked == "relative_error") settings.relative_error = 0.01;
  if (asked == "exact_patches") settings.measure = Measure::exact;
  if (asked == "contact_patches" || asked == "exact_patches") {
    ContactPatch patches[6];
    const ContactPatches answer = contact_patches(a, b, settings, workspace, patches);
    bits.add(answer.penetration);
    for (std::size_t i = 0; i < answer.count; ++i) {
      bits.add(patches[i]);
      if (asked != "exact_patches") continue;
      for (const double x : {patches[i].point.x(), patches[i].point.y(), patches[i].point.z()})
        bits.add(x);
      bits.add(patches[i].torsion);
    }
    return;
  }
  if (asked == "time_of_impact") {
    Motions motions;
    motions.a.angular_velocity = {0.5, 0.25, -1};
    motions.b = {{-1, 0.5, -0.75}, {3, -2, 1}, {0.125, 0, 0.25}};
    ImpactSettings until;
    until.max_visits = 3000;
    bits.add(time_of_impact(a, b, motions, until, workspace));
    return;
  }
  const PenetrationAndSeparation both = query(a, b, testing::for_both(settings), workspace);
  bits.add(both.penetration);
  bits.add(both.separation);
  if constexpr (std::is_same_v<A, PlacedAsset>) {
    if (asked == "matched") bits.add(without_protrusion(both.penetration, a, b));
  }
}

std::string hash_of(const Row& row) {
  constexpr std::string_view kField = "field ";  // before what is asked of one
  std::uint64_t hash = 0;
  if (row.asked == "asset") {
    hash = asset_named(row.a).view().header().content_hash;
  } else {
    const Asset& b = asset_named(row.b);
    Poses poses;
    Workspace workspace;
    AnswerBits bits;
    for (int i = 0; i < 60; ++i) {
      const double scale = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.3 : 0.001;
      const Pose pose_a = poses.next(0.1);
      const PlacedAsset pb{b.view(), poses.next(0.03 * i), scale};
      if (row.asked.starts_with(kField)) {
        const PlacedShape pa{field_named(row.a), pose_a, 1.0};
        ask(row.asked.substr(kField.size()), pa, pb, workspace, bits);
      } else {
        const PlacedAsset pa{asset_named(row.a).view(), pose_a, 1.0};
        ask(row.asked, pa, pb, workspace, bits);
      }
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

/// With IST_WRITE_HASHES=1 the table is written anew, by what this machine answers: look at every
/// row that changes.
TEST(InstructionSets, WriteTheTable) {
  const char* const wanted = std::getenv("IST_WRITE_HASHES");
  if (wanted == nullptr || std::string(wanted) != "1") GTEST_SKIP() << "IST_WRITE_HASHES is not 1";
  const std::vector<Row> rows = read_table();
  ASSERT_FALSE(rows.empty());
  std::string text = "a,b,asked,hash\n";
  for (const Row& row : rows)
    text += row.a + ',' + row.b + ',' + row.asked + ',' + hash_of(row) + '\n';
  std::ofstream(kTable) << text;
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
