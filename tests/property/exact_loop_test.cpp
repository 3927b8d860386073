// Exact queries as steps of a motion (PenetrationSettings::pair_id).

#include <gtest/gtest.h>
#include <ist/query.h>

#include <cmath>
#include <numbers>
#include <random>

#include "mesh/samples/samples.h"
#include "support/answer_bits.h"
#include "support/exact_pair.h"
#include "support/test_meshes.h"
#include "support/turns.h"

namespace ist {
namespace {

/// The nut that has turned down the bolt so often, and is `above` its place.
Pose on_thread(double turns, double above) {
  const double half = std::numbers::pi * turns;
  return {{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 10 + above + kThreadPitch * turns}};
}

class ExactLoop : public ::testing::Test {
 protected:
  Penetration ask(const Asset& a, const Asset& b, const Pose& pose, std::uint32_t pair_id) {
    PenetrationSettings settings;
    settings.measure = Measure::exact;
    settings.pair_id = pair_id;
    return penetration({a.view(), {}, 1}, {b.view(), pose, 1}, settings, workspace_);
  }

  /// Compares all results of an exact query except node visits.
  std::uint64_t bits(const Asset& a, const Asset& b, const Pose& pose, std::uint32_t pair_id) {
    ContactSettings settings;
    settings.measure = Measure::exact;
    settings.pair_id = pair_id;
    const PlacedAsset at_a{a.view(), {}, 1}, at_b{b.view(), pose, 1};
    std::vector<OutlineSegment> segments(8000);
    testing::AnswerBits bits;
    const auto add = [&](ContactPatches contact) {
      contact.penetration.node_visits = 0;
      bits.add(contact.penetration);
      for (std::size_t p = 0; p < contact.count; ++p) bits.add(patches_[p]);
    };
    add(contact_patches(at_a, at_b, settings, workspace_, patches_));
    const OverlapOutline outline =
        overlap_outline(at_a, at_b, settings, workspace_, patches_, segments);
    add(outline.contact);
    for (std::size_t s = 0; s < std::min(outline.segments, segments.size()); ++s) {
      bits.add(segments[s].from);
      bits.add(segments[s].to);
      bits.add(std::uint64_t{segments[s].patch});
    }
    return bits.value();
  }

  const Asset bolt_ = testing::surface(make_sample("bolt"));
  const Asset nut_ = testing::surface(make_sample("nut"));
  Workspace workspace_;
  ContactPatch patches_[16];
};

TEST_F(ExactLoop, PatchesAndOutlinesHaveTheSameBits) {
  for (int i = 0; i < 60; ++i) {
    const Pose pose = on_thread(0.1 + 2e-4 * i, 0.1 * std::sin(0.02 * i));
    EXPECT_EQ(bits(bolt_, nut_, pose, 0), bits(bolt_, nut_, pose, 1)) << i;
  }
}

TEST_F(ExactLoop, PartsThatJoinAndComeApartHaveTheSameBits) {
  // Two feet that rock on a table, in steps of which half change no crossing.
  const Asset table = testing::surface(testing::box_mesh({-9, -9, -1}, {9, 9, 0}));
  const Asset feet =
      testing::surface(testing::joined(testing::box_mesh({-1, -0.4, 0}, {-0.2, 0.4, 1}),
                                       testing::box_mesh({0.2, -0.3, 0}, {1, 0.3, 1})));
  std::size_t most = 0, least = 99;
  for (int i = 0; i < 600; ++i) {
    const double turn = 0.02 * std::sin(0.05 * (i / 2));
    const Pose pose = {{std::cos(turn), 0, std::sin(turn), 0}, {1e-7 * i, 0, -0.005}};
    EXPECT_EQ(bits(table, feet, pose, 0), bits(table, feet, pose, 1)) << i;
    ContactSettings settings;
    settings.measure = Measure::exact;
    const std::size_t parts = overlap_outline({table.view(), {}, 1}, {feet.view(), pose, 1},
                                              settings, workspace_, patches_, {})
                                  .contact.count;
    most = std::max(most, parts);
    least = std::min(least, parts);
  }
  EXPECT_EQ(least, 1u);
  EXPECT_GE(most, 2u);
}

// Edges of copies that are moved and not turned are parallel but for rounding: no plane along both
// keeps their triangles apart.
TEST_F(ExactLoop, CopiesThatAreMovedHaveTheSameBits) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> shift(-0.2, 0.2);
  for (const std::uint32_t around : {8u, 16u, 24u, 48u})
    for (const std::uint32_t across : {4u, 6u, 8u}) {
      const Asset ring = testing::surface(testing::torus_mesh(1, 0.4, around, across));
      for (std::uint32_t i = 1; i <= 50; ++i) {
        const Pose pose = {{1, 0, 0, 0}, {shift(random), shift(random), shift(random)}};
        const std::uint64_t alone = bits(ring, ring, pose, 0);
        for (int step = 0; step < 3; ++step)
          ASSERT_EQ(bits(ring, ring, pose, i), alone)
              << around << " by " << across << ", shift " << i << ", step " << step;
      }
    }
}

TEST_F(ExactLoop, InClearanceNothingIsSearchedAndNothingTouches) {
  int searched = 0;
  for (int i = 0; i < 200; ++i) {
    const Penetration p = ask(bolt_, nut_, on_thread(1e-4 * i, 0), 1);
    EXPECT_EQ(p.volume_max, 0) << i;
    EXPECT_EQ(p.status, QueryStatus::ok) << i;
    searched += p.node_visits > 0 ? 1 : 0;
  }
  EXPECT_LE(searched, 80);
}

// The energy of a contact whose force is the gradient of ½ V², at 1 kHz: one turn a second.
TEST_F(ExactLoop, AClosedPathGivesNoEnergy) {
  double sum = 0, all = 0;
  Eigen::Vector3d force, place;
  for (int i = 0; i <= 1000; ++i) {
    const double t = 2 * std::numbers::pi * i / 1000;
    Pose pose = on_thread(0.1, 0.5 + 0.2 * std::sin(t));
    pose.t[0] = 0.2 * std::cos(t);
    pose.t[1] = 0.2 * std::sin(2 * t);
    const Penetration p = ask(bolt_, nut_, pose, 1);
    ASSERT_GT(p.volume, 1);
    const Eigen::Vector3d pull = p.volume * p.force, now(pose.t[0], pose.t[1], pose.t[2]);
    if (i > 0) {
      const double work = 0.5 * (pull + force).dot(now - place);
      sum += work;
      all += std::abs(work);
    }
    force = pull;
    place = now;
  }
  EXPECT_LE(std::abs(sum), 1e-6 * all);
}

// More pairs than there are places, numbers whose solids change, and motions that jump.
TEST_F(ExactLoop, AnyUseOfNumbersGivesTheSameBits) {
  const Asset ball = testing::surface(testing::icosphere_mesh(2));
  const Asset box = testing::surface(testing::box_mesh({-1, -0.5, -0.7}, {0.8, 0.6, 0.9}));
  const Asset* const solids[] = {&ball, &box};
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Pose> poses(3000);
  for (Pose& pose : poses) {
    const Eigen::Quaterniond q = testing::random_turn(random);
    pose = {{q.w(), q.x(), q.y(), q.z()}, {unit(random), unit(random), unit(random)}};
  }
  for (int step = 0; step < 6; ++step)
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Pose& pose = poses[i];
      for (double& t : pose.t) t += (i % 7 == 0 ? 0.1 : 1e-3) * unit(random);
      const Asset &a = *solids[i % 2], &b = *solids[(i / 2 + (step == 4 ? 1 : 0)) % 2];
      Penetration fresh = ask(a, b, pose, 0), kept = ask(a, b, pose, std::uint32_t(1 + i));
      fresh.node_visits = kept.node_visits = 0;
      testing::AnswerBits x, y;
      x.add(fresh);
      y.add(kept);
      ASSERT_EQ(x.value(), y.value()) << step << ' ' << i;
    }
}

// A list that does not fit into the workspace is given up. With even less memory nothing is
// finished.
TEST_F(ExactLoop, CapacityChangesNoBit) {
  const Asset ball = testing::surface(testing::icosphere_mesh(4));
  for (std::size_t capacity = 4000; capacity < 40000; capacity += capacity / 8) {
    Workspace small(capacity);
    for (int i = 0; i < 12; ++i) {
      const PlacedAsset a{ball.view(), {}, 1},
          b{ball.view(), {{1, 0, 0, 0}, {0, 0.002 * i, 0.1}}, 1};
      PenetrationSettings settings;
      settings.measure = Measure::exact;
      testing::AnswerBits bits[2];
      for (const std::uint32_t id : {0u, 1u}) {
        settings.pair_id = id;
        Penetration p = penetration(a, b, settings, small);
        p.node_visits = 0;
        bits[id].add(p);
      }
      EXPECT_EQ(bits[0].value(), bits[1].value()) << capacity << ' ' << i;
    }
  }
}

TEST_F(ExactLoop, UnderAVisitLimitNothingIsKept) {
  PenetrationSettings settings;
  settings.measure = Measure::exact;
  settings.pair_id = 1;
  settings.max_visits = 1'000'000;
  for (int i = 0; i < 10; ++i) {
    const Pose pose = on_thread(1e-4 * i, 0.5);
    EXPECT_GT(penetration({bolt_.view(), {}, 1}, {nut_.view(), pose, 1}, settings, workspace_)
                  .node_visits,
              0);
  }
}

}  // namespace
}  // namespace ist
