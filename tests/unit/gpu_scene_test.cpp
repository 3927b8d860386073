#include <gtest/gtest.h>
#include <ist/types.h>

#include <string>

#include "support/host_scene.h"
#include "support/random_scene.h"

// The GPU's broad phase, its source run by teams of the host, beside Scene.

namespace ist::testing {
namespace {

NamedPairs names_of(const GpuScenePairs& found) {
  NamedPairs out;
  for (std::uint32_t k = 0; k < *found.count; ++k) out.emplace_back(found.a[k], found.b[k]);
  return out;
}

TEST(GpuScene, HasThePairsOfScene) {
  std::size_t pairs = 0, refused = 0, scenes = 0;
  for (const std::size_t count : {0, 1, 2, 31, 32, 33, 200, 1100}) {
    for (const std::uint32_t worlds : {1u, 3u, 40u}) {
      if (count > 1000 && worlds != 3) continue;
      RandomScene random(some_solids(), count, worlds, static_cast<unsigned>(++scenes));
      random.settings.excluded = random.excluded;
      HostScene scene(random.solids, random.bodies, random.settings);
      for (int step = 0; step < 2; ++step) {
        const GpuScenePairs found = scene.find_pairs(random.poses, 3);
        const auto [expected, left_out] = random.by_scene();
        ASSERT_EQ(names_of(found), expected) << scenes << ", step " << step;
        EXPECT_EQ(*found.boxes_met, expected.size());
        std::vector<std::uint32_t> bad;
        for (std::uint32_t i = 0; i < count; ++i)
          if (found.status[i] != QueryStatus::ok) bad.push_back(i);
        EXPECT_EQ(bad, left_out);
        for (std::uint32_t k = 0; k < random.settings.max_pairs; ++k) {
          if (k >= expected.size()) {
            ASSERT_GE(found.pairs.a.solid[k], random.solids.size());
            continue;
          }
          const std::uint32_t a = expected[k].first, b = expected[k].second;
          ASSERT_EQ(found.pairs.a.solid[k], random.bodies[a].solid);
          ASSERT_EQ(found.pairs.b.solid[k], random.bodies[b].solid);
          ASSERT_EQ(found.pairs.a.scale[k], random.bodies[a].scale);
          ASSERT_EQ(found.pairs.b.pose[k].t[1], random.poses[b].t[1]);
        }
        pairs += expected.size();
        refused += bad.size();
        random.move(10);
      }
    }
  }
  EXPECT_GT(pairs, 10'000u);
  EXPECT_GT(refused, 50u);
}

TEST(GpuScene, PairsThatHaveNoRoomAreNone) {
  RandomScene random(some_solids(), 60, 1, 5);
  random.move(3);
  random.settings.max_pairs = 20;
  const GpuScenePairs found =
      HostScene(random.solids, random.bodies, random.settings).find_pairs(random.poses, 3);
  EXPECT_EQ(*found.count, 0u);
  EXPECT_GT(*found.boxes_met, 20u);
  for (int k = 0; k < 20; ++k) EXPECT_GE(found.pairs.a.solid[k], random.solids.size());
}

TEST(GpuScene, RefusesWhatItCannotHold) {
  const auto fault = [](const std::vector<GpuSceneBody>& bodies, GpuSceneSettings settings = {}) {
    try {
      HostScene(some_solids(), bodies, settings);
      return std::string();
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(fault({{}}), "");
  EXPECT_EQ(fault({{}, {.solid = 7}}), "GPU scene: body 1 is of solid 7; there are 7");
  EXPECT_EQ(fault({{.world = kGpuWorlds}}),
            "GPU scene: body 0 is of world 16777216; worlds are below 16777216");
  EXPECT_EQ(fault({}, {.margin = -1}), "GPU scene: a margin that is negative, infinite or NaN");
  EXPECT_EQ(fault({}, {.max_pairs = 0}), "GPU scene: max_pairs is 1 … 2^32 - 2");
  const ScenePairName two[] = {{0, 3}};
  EXPECT_EQ(fault({{}}, {.excluded = two}),
            "GPU scene: an excluded pair of bodies 0 and 3; there are 1");
}

}  // namespace
}  // namespace ist::testing
