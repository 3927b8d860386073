#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>

#include "mesh/samples/samples.h"
#include "support/oracle_assets.h"
#include "support/shared_data.h"

// Flat faces that meet, without protrusion.

namespace ist {
namespace {

class FlatFaces : public ::testing::Test {
 protected:
  static const Asset& cube() {
    static const Asset asset =
        bake(close_mesh(make_sample("cube"), "cube"), {.max_spheres = 2'000});
    return asset;
  }
  const double side_ = std::cbrt(cube().view().volume());
  const double radius_ = side_ * std::cbrt(3 / (4 * M_PI * 2'000));  ///< [u] of the mean sphere
  Workspace workspace_;

  struct Answers {
    Penetration raw, sharp;
  };
  /// `gap` [u]; B is turned about the faces' normal and shifted along them.
  Answers at(double gap, double turn = 0.3) {
    const PlacedAsset a{cube().view(), {}, 1};
    const PlacedAsset b{
        cube().view(),
        {{std::cos(turn), std::sin(turn), 0, 0}, {side_ + gap, 0.1 * side_, -0.05 * side_}},
        1};
    const Penetration raw = penetration(a, b, {.spheres_only = true}, workspace_);
    return {raw, without_protrusion(raw, a, b)};
  }
};

TEST_F(FlatFaces, NothingIsReadAcrossAGap) {
  const double face = at(-radius_).raw.volume / radius_;
  for (const double turn : {0.0, 0.2, 0.5}) {
    EXPECT_GT(at(0, turn).raw.volume, 0.05 * radius_ * face);
    EXPECT_LT(at(0, turn).sharp.volume, 0.04 * radius_ * face);
    for (double gap = 0.1; gap < 0.3; gap += 0.02)
      EXPECT_LT(at(gap * radius_, turn).sharp.volume, 0.002 * radius_ * face) << gap;
  }
}

TEST_F(FlatFaces, DeeperContactsAreLeftAlone) {
  for (double depth = 0.4; depth < 10; depth *= 1.3) {
    const Answers answers = at(-depth * radius_);
    EXPECT_EQ(answers.sharp.volume, answers.raw.volume);
    EXPECT_EQ(answers.sharp.force, answers.raw.force);
  }
}

TEST_F(FlatFaces, VolumeAndForceGrowSmoothlyWithTheDepth) {
  const int steps = 400;
  double work = 0, largest_step = 0;
  Penetration before = at(0.5 * radius_).sharp;
  const double step = 0.9 * radius_ / steps;
  for (int i = 1; i <= steps; ++i) {
    const Penetration now = at(0.5 * radius_ - i * step).sharp;
    // A single lens that grazes is round.
    EXPECT_GE(now.volume, before.volume - 1e-5 * radius_ * side_ * side_);
    EXPECT_LE(now.volume_min, now.volume);
    EXPECT_GE(now.volume_max, now.volume);
    work += step * (now.force.x() + before.force.x()) / 2;
    largest_step = std::max(largest_step, (now.force - before.force).norm());
    before = now;
  }
  EXPECT_NEAR(work, before.volume, 0.15 * before.volume);
  // From none to all of the force in a fifth of a radius: 90 steps. A jump would be all of it.
  EXPECT_LT(largest_step, 0.1 * before.force.norm());
}

/// Patches of a face lose what the whole loses, and where faces lean against each other those that
/// hardly touch lose more.
TEST_F(FlatFaces, PatchesLoseIt) {
  ContactSettings settings;
  settings.spheres_only = true;
  const PlacedAsset a{cube().view(), {}, 1};
  const auto asked = [&](const PlacedAsset& b, ContactSettings how) {
    std::vector<ContactPatch> patches(16);
    patches.resize(contact_patches(a, b, how, workspace_, patches).count);
    std::vector<ContactPatch> sharp = patches;
    without_protrusion(sharp, a, b, how);
    return std::pair(patches, sharp);
  };
  const auto volume_of = [](const std::vector<ContactPatch>& patches) {
    double sum = 0;
    for (const ContactPatch& patch : patches) sum += patch.volume;
    return sum;
  };
  PlacedAsset b = a;
  b.pose = {{std::cos(0.3), std::sin(0.3), 0, 0}, {0, 0.1 * side_, -0.05 * side_}};  // as at()
  const double layer = radius_ * side_ * side_;
  for (double gap = -1; gap < 0.3; gap += 0.05) {
    b.pose.t[0] = side_ + gap * radius_;
    const auto [raw, sharp] = asked(b, settings);
    EXPECT_NEAR(volume_of(sharp), at(gap * radius_).sharp.volume, 0.02 * layer) << gap;
    if (gap < -0.5) {
      EXPECT_EQ(volume_of(sharp), volume_of(raw));
    }
    if (gap > 0.1) {
      EXPECT_LT(volume_of(sharp), 0.002 * layer);
    }
    for (std::size_t i = 0; i < raw.size(); ++i) {
      EXPECT_LE(sharp[i].volume, raw[i].volume);
      EXPECT_EQ(sharp[i].id, raw[i].id);
      EXPECT_NEAR(sharp[i].area, sharp[i].force.norm(), 1e-12 * raw[i].area);
      EXPECT_LE(sharp[i].depth, raw[i].depth * (1 + 1e-12));
    }
  }

  // The surface and inner spheres do not protrude.
  b.pose.t[0] = side_ + 0.05 * radius_;
  b.scale = 0.1;
  b.pose.t[0] -= 0.45 * side_;
  for (const bool inner : {false, true}) {
    ContactSettings exact;
    if (inner) exact.measure = Measure::inner;
    b.pose.t[0] -= inner ? radius_ : 0;
    const auto [raw, sharp] = asked(b, exact);
    EXPECT_EQ(volume_of(sharp), volume_of(raw));
  }
}

TEST(RoundContacts, KeepTheirVolume) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  Workspace workspace;
  for (const testing::OracleRow& row : testing::read_oracle_rows("eledino")) {
    if (row.pose_class != "pen") continue;
    const auto [a, b] = testing::placed(row, 1'500);
    const Penetration raw = penetration(a, b, {.spheres_only = true}, workspace);
    EXPECT_EQ(without_protrusion(raw, a, b).volume, raw.volume) << row.id;
  }
}

}  // namespace
}  // namespace ist
