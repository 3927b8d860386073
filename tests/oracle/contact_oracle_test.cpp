#include "support/contact_oracle.h"

#include <gtest/gtest.h>

namespace ist::testing {
namespace {

constexpr std::size_t kSpheres = 1000;

/// Counts over all cases, for the reader of the log.
struct Tally {
  std::size_t cases = 0, meet = 0;

  /// Every false statement fails the test, with its reason.
  void expect(const ContactCase& c, const ContactVerdict& verdict) {
    ++cases;
    meet += c.meet();
    for (const std::string& wrong : verdict.wrong) ADD_FAILURE() << c.name << ": " << wrong;
  }
};

double quantile(std::vector<double> values, std::size_t percent) {
  std::sort(values.begin(), values.end());
  return values[values.size() * percent / 100];
}

class OracleRows : public ::testing::TestWithParam<std::string> {};

TEST_P(OracleRows, AgreeWithFclBulletAndExactDistances) {
  const std::string key = GetParam();
  IST_NEEDS_SHARED("oracle/poses/truth_" + key + ".csv");
  const auto rows = read_oracle_rows(key);
  Model a(oracle_mesh_path(rows.front().mesh_a), kSpheres);
  Model b(oracle_mesh_path(rows.front().mesh_b), kSpheres);
  ContactJudge judge;
  Tally tally;
  std::vector<double> ist, fcl, bullet;  // [degrees] to the exact force
  for (const OracleRow& row : rows) {
    const ContactCase c = case_of(row, a, b);
    SCOPED_TRACE(c.name);
    // FCL, the judge of the random poses below, must know the exact answers itself.
    EXPECT_NEAR(fcl_distance(c.a->fcl, {}, c.b->fcl, c.pose_b), c.surface_distance, 1e-6);
    const ContactVerdict verdict = judge.judge(c);
    EXPECT_EQ(verdict.fcl, c.cross());
    tally.expect(c, verdict);
    if (row.pose_class != "pen" || row.fraction_of_smaller < 1e-3) continue;
    const ForceAngles angles = judge.angles(c);
    EXPECT_LT(angles.ist, 90) << "the force pulls B in";
    ist.push_back(angles.ist);
    fcl.push_back(angles.fcl);
    bullet.push_back(angles.bullet);
  }
  // ist must point better than either, in the median and in the tail.
  for (const std::size_t percent : {50u, 95u}) {
    EXPECT_LT(quantile(ist, percent), quantile(fcl, percent));
    EXPECT_LT(quantile(ist, percent), quantile(bullet, percent));
  }
}

INSTANTIATE_TEST_SUITE_P(Contact, OracleRows, ::testing::ValuesIn(kPairKeys),
                         [](const auto& info) { return info.param; });

struct MeshPair {
  std::string name, a, b;
  double size_b;  ///< B's diagonal over A's
};

class RandomPoses : public ::testing::TestWithParam<MeshPair> {};

TEST_P(RandomPoses, AgreeWithFclAndBullet) {
  const MeshPair pair = GetParam();
  IST_NEEDS_SHARED(pair.a);
  IST_NEEDS_SHARED(pair.b);
  constexpr int kPoses = 90;
  Model a(shared_path(pair.a).string(), kSpheres), b(shared_path(pair.b).string(), kSpheres);
  RandomContacts contacts(a, b, pair.size_b, 20240917);
  ContactJudge judge;
  Tally tally;
  for (int i = 0; i < kPoses; ++i) {
    const ContactCase c = contacts.next();
    tally.expect(c, judge.judge(c));
  }
  EXPECT_GT(tally.meet, 10u) << "the poses must try something";
  EXPECT_LT(tally.meet + 10, tally.cases);
}

INSTANTIATE_TEST_SUITE_P(
    Contact, RandomPoses,
    ::testing::Values(MeshPair{"spot_torus", "meshes/dev/spot.obj", "meshes/dev/torus.off", 1.2},
                      MeshPair{"mug_spot", "meshes/dev/mug.ply", "meshes/dev/spot.obj", 0.12},
                      MeshPair{"tray_peg", "meshes/dev/hole_tray_round_16mm.obj",
                               "meshes/dev/peg_round_16mm.obj", 0.9}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace ist::testing
