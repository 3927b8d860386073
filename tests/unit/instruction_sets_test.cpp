#include <gtest/gtest.h>
#include <ist/query.h>

#include <hwy/highway.h>

#include <cstring>

#include "support/query_settings.h"
#include "support/random_assets.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;

/// Answers for many poses, scales and both measures, as bytes.
std::vector<unsigned char> answers(const Asset& a, const Asset& b) {
  std::mt19937_64 random(3);
  Workspace workspace;
  std::vector<unsigned char> bytes;
  const auto keep = [&](const auto& value) {
    const auto* p = reinterpret_cast<const unsigned char*>(&value);
    bytes.insert(bytes.end(), p, p + sizeof(value));
  };
  for (int i = 0; i < 60; ++i) {
    PenetrationSettings settings;
    settings.measure = i % 2 == 0 ? Measure::matched : Measure::inner;
    settings.max_visits = i % 5 == 4 ? 50 : 0;
    settings.pair_budget = i % 7 >= 4 ? 300 : 0;
    const double scale = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.3 : 0.001;
    const PlacedTree pa{a.view(), random_pose(random, 0.2), 1.0};
    const PlacedTree pb{b.view(), random_pose(random, 0.05 * i), scale};
    const PenetrationAndSeparation both = query(pa, pb, testing::for_both(settings), workspace);
    const Penetration& p = both.penetration;
    const Separation& s = both.separation;
    keep(p.volume), keep(p.volume_min), keep(p.volume_max), keep(p.node_visits);
    keep(p.sphere_pairs), keep(p.status), keep(s.distance), keep(s.distance_min);
    keep(s.distance_max), keep(s.node_visits), keep(s.status);
    for (const Eigen::Vector3d& v :
         {p.centroid, p.translation_gradient, p.rotation_gradient, s.point_a, s.point_b, s.normal})
      for (int k = 0; k < 3; ++k) keep(v[k]);
    ContactPatch patches[6];
    const std::size_t count =
        contact_patches(pa, pb, testing::for_contacts(settings), workspace, patches).count;
    for (const ContactPatch& patch : std::span(patches, count)) {
      keep(patch.id), keep(patch.volume), keep(patch.area), keep(patch.depth);
      for (const Eigen::Vector3d& v : {patch.centroid, patch.normal, patch.force, patch.torque})
        for (int k = 0; k < 3; ++k) keep(v[k]);
    }
  }
  return bytes;
}

TEST(InstructionSets, GiveTheSameBits) {
  const Asset a = make_random_asset({900, 0.1, {}, 0, 2}, 1);
  const Asset b = make_random_asset({400, 0.3, {}, 0, 1}, 2);
  const auto native = answers(a, b);
  EXPECT_EQ(answers(a, b), native) << "a repeated query";
  int levels = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    EXPECT_TRUE(answers(a, b) == native) << hwy::TargetName(target);
    ++levels;
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GE(levels, 1);
}

}  // namespace
}  // namespace ist
