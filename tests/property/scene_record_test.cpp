#include <gtest/gtest.h>
#include <ist/scene.h>
#include <ist/types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/answer_bits.h"
#include "support/baked.h"
#include "support/float_traps.h"
#include "support/surface_queries.h"
#include "support/test_meshes.h"

// Records of scenes, and events over many steps.

namespace ist {
namespace {

using namespace testing;
using Bytes = std::vector<std::byte>;

const Asset& cube() {
  static const Asset asset = baked(box_mesh({-1, -1, -1}, {1, 1, 1}), "cube", 60);
  return asset;
}

SceneBody at(std::uint32_t number, const PlacedSolid& solid, bool moves = true) {
  SceneBody out;
  out.number = number;
  out.solid = solid;
  out.moves = moves;
  return out;
}

/// Bodies of every kind that has a record, some of which touch.
struct Mixed {
  std::vector<float> heights = std::vector<float>(12, 0.5f), distances = std::vector<float>(27, 1);
  Scene scene{{.max_bodies = 16, .max_pairs = 200}};

  Mixed() {
    distances[13] = -1;
    SceneRule exact;
    exact.penetration.measure = Measure::exact;
    exact.margin = 0.25;
    scene.set_rule(0, 0, exact);
    SceneRule patches;
    patches.answer = SceneAnswer::patches;
    scene.set_rule(0, 1, patches);
    scene.add(at(7, {cube().view(), {{1, 0, 0, 0}, {0, 0, 0}}}));
    scene.add(at(3, {cube().view(), {{1, 0.5, 0, 0}, {1.9, 0, 0}}, 0.75}));
    const auto field = [&](std::uint32_t number, const Shape& of) {
      SceneBody body = at(number, PlacedSolid(of, {{1, 0, 0, 0}, {0.25, 0.5, -0.5}}), false);
      body.group = 1;
      scene.add(body);
    };
    field(20, HalfSpaceShape{{0, 0, 1}, -0.75});
    field(21, BoxShape{{1, 0.5, 2}});
    field(22, BallShape{0.5});
    field(23, CapsuleShape{0.5, 1});
    field(24, CylinderShape{0.5, 1});
    field(25, HeightFieldShape{heights.data(), 4, 3, {1, 1}});
    field(26, DistanceGridShape{distances.data(), {3, 3, 3}, {-1, -1, -1}, 1, 0});
    scene.exclude(3, 22);
  }
};

std::uint64_t bits_of(Scene& scene) {
  const SceneStep step = scene.step();
  AnswerBits bits;
  for (const ScenePair& pair : step.pairs) {
    bits.add(std::uint64_t{pair.a} << 32 | pair.b);
    bits.add(static_cast<std::uint64_t>(pair.event));
    bits.add(scene.penetration(pair));
    bits.add(scene.separation(pair));
    for (const ContactPatch& patch : scene.patches(pair)) bits.add(patch);
  }
  for (const ScenePairName& pair : step.ended) bits.add(std::uint64_t{pair.a} << 32 | pair.b);
  return bits.value();
}

TEST(SceneRecord, HoldsEveryKindOfBodyAndWhatMetBefore) {
  Mixed mixed;
  const std::array<AssetView, 1> assets = {cube().view()};
  for (int step = 0; step < 3; ++step) {
    Scene again = Scene::replay(mixed.scene.record(), assets, 3);
    EXPECT_EQ(again.size(), 9u);
    EXPECT_EQ(again.record(), mixed.scene.record());
    const std::uint64_t bits = bits_of(mixed.scene);
    EXPECT_EQ(bits_of(again), bits);
    mixed.scene.set_pose(3, {{1, 0, 0, 0}, {1.5 + step, 0, 0.25}});
  }
  EXPECT_GE(mixed.scene.step().boxes_met, 5u);
}

TEST(SceneRecord, AFilterIsWhatItRefuses) {
  Mixed mixed;
  mixed.scene.set_filter(
      [](const void*, std::uint32_t a, std::uint32_t b) noexcept { return (a + b) % 2 == 0; },
      nullptr);
  const std::array<AssetView, 1> assets = {cube().view()};
  Scene again = Scene::replay(mixed.scene.record(), assets);
  EXPECT_EQ(bits_of(again), bits_of(mixed.scene));
}

std::string fault_of(const Bytes& record, std::span<const AssetView> assets) {
  try {
    Scene::replay(record, assets);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(SceneRecord, WhatIsMissingIsNamed) {
  Mixed mixed;
  const Bytes record = mixed.scene.record();
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx",
                static_cast<unsigned long long>(cube().view().header().content_hash));
  EXPECT_NE(fault_of(record, {}).find(hash), std::string::npos);
  SceneBody body = at(30, PlacedSolid(Shape(FunctionShape{}), Pose{}));
  mixed.scene.add(body);
  EXPECT_THROW(mixed.scene.record(), Error);
}

TEST(SceneRecord, NoBytesDoMoreThanRaise) {
  Mixed mixed;
  mixed.scene.step();
  const std::array<AssetView, 1> assets = {cube().view()};
  const Bytes record = mixed.scene.record();
  ASSERT_EQ(fault_of(record, assets), "");
  for (std::size_t size = 0; size < record.size(); ++size)
    EXPECT_NE(fault_of(Bytes(record.begin(), record.begin() + static_cast<long>(size)), assets),
              "");
  constexpr std::size_t kHeader = 24, kHash = 16;
  std::mt19937 random(1);
  const auto below = [&](std::size_t most) {
    return std::uniform_int_distribution<std::size_t>(0, most - 1)(random);
  };
  const NoFloatTraps any_numbers;
  int raised = 0, answered = 0;
  for (int i = 0; i < 4000; ++i) {
    Bytes changed = record;
    for (std::size_t k = below(3) + 1; k-- > 0;) {
      const std::size_t where = kHeader + below(record.size() - kHeader);
      changed[where] = static_cast<std::byte>(below(2) == 0 ? 255 * below(2) : below(256));
    }
    if (below(4) == 0) changed.resize(kHeader + below(changed.size() - kHeader));
    if (changed != record) {
      EXPECT_NE(fault_of(changed, assets), "");
    }
    // With a matching hash, as an attacker would write.
    const std::uint64_t hash = XXH3_64bits(changed.data() + kHeader, changed.size() - kHeader);
    std::memcpy(changed.data() + kHash, &hash, sizeof hash);
    try {
      Scene scene = Scene::replay(changed, assets);
      scene.step();
      ++answered;
    } catch (const Error&) {
      ++raised;
    }
  }
  EXPECT_GT(raised, 500);
  EXPECT_GT(answered, 500);
}

TEST(SceneEvents, AreConsistentOverTenThousandSteps) {
  std::mt19937 random(3);
  const auto below = [&](std::uint32_t most) {
    return std::uniform_int_distribution<std::uint32_t>(0, most - 1)(random);
  };
  const auto place = [&] {
    return Pose{{1, 0, 0, 0}, {0.5 * below(16), 0.5 * below(16), 0.5 * below(16)}};
  };
  Scene scene({.max_bodies = 40});
  SceneRule boxes;
  boxes.answer = SceneAnswer::boxes;
  boxes.penetration.measure = Measure::exact;
  scene.set_rule(0, 0, boxes);
  std::map<std::uint32_t, Pose> poses;
  const auto add = [&](std::uint32_t number) {
    poses[number] = place();
    scene.add(at(number, {cube().view(), poses[number]}));
  };
  for (std::uint32_t i = 0; i < 40; ++i) add(i);
  using Names = std::set<std::pair<std::uint32_t, std::uint32_t>>;
  Names met;
  std::size_t begun = 0, over = 0;
  for (int step = 0; step < 10'000; ++step) {
    const SceneStep found = scene.step();
    Names now;
    for (const ScenePair& pair : found.pairs) {
      now.insert({pair.a, pair.b});
      ASSERT_EQ(pair.event == SceneEvent::stays, met.count({pair.a, pair.b}) == 1) << step;
      begun += pair.event == SceneEvent::begins ? 1 : 0;
    }
    for (const ScenePairName& pair : found.ended) {
      ASSERT_EQ(met.count({pair.a, pair.b}), 1u) << step;
      ASSERT_EQ(now.count({pair.a, pair.b}), 0u) << step;
    }
    // Pairs that met before stay or end.
    std::size_t stayed = 0;
    for (const auto& pair : now) stayed += met.count(pair);
    ASSERT_EQ(met.size(), stayed + found.ended.size()) << step;
    over += found.ended.size();
    // Boxes of side 2 meet where their middles are no further apart along any axis, flush ones too.
    if (step % 50 == 0) {
      Names truth;
      for (const auto& [a, p] : poses)
        for (const auto& [b, q] : poses) {
          bool meet = a < b;
          for (int k = 0; k < 3; ++k) meet = meet && std::abs(p.t[k] - q.t[k]) <= 2;
          if (meet) truth.insert({a, b});
        }
      ASSERT_EQ(now, truth) << step;
    }
    met = std::move(now);
    for (std::uint32_t i = below(step % 7 == 0 ? 40 : 3); i-- > 0;) {
      const std::uint32_t number = below(40);
      if (poses.count(number) == 0) continue;
      poses[number] = place();
      scene.set_pose(number, poses[number]);
    }
    const std::uint32_t number = below(40);
    if (poses.erase(number) == 1)
      scene.remove(number);
    else
      add(number);
  }
  // None is still met once all have gone.
  for (const auto& [number, pose] : poses) scene.remove(number);
  over += scene.step().ended.size();
  EXPECT_EQ(begun, over);
  EXPECT_GT(begun, 10'000u);
}

}  // namespace
}  // namespace ist
