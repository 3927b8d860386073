#pragma once

#include <ist/gpu_scene.h>
#include <ist/scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "support/baked.h"
#include "support/test_meshes.h"

namespace ist::testing {

using NamedPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// A cube, a slab beside its frame's origin, and shapes, one of which is unbounded and one invalid.
inline std::vector<GpuSolid> some_solids() {
  static const Asset cube = baked(box_mesh({-1, -1, -1}, {1, 1, 1}), "cube", 60);
  static const Asset off_centre = baked(box_mesh({0.5, -1, 0}, {1, 3, 0.25}), "slab", 60);
  return {cube.view(),
          off_centre.view(),
          Shape(BallShape{0.5}),
          Shape(BoxShape{{1, 0.5, 2}}),
          Shape(HalfSpaceShape{{0, 0, 1}, -0.75}),
          Shape(CapsuleShape{0.5, 1}),
          Shape(BoxShape{{1, -0.5, 2}})};
}

/// Bodies of some solids in several worlds, moving and not, in random poses, flush on a lattice, in
/// place of each other; some poses are none.
struct RandomScene {
  std::vector<GpuSolid> solids;
  std::vector<GpuSceneBody> bodies;
  std::vector<Pose> poses;
  std::vector<ScenePairName> excluded;
  GpuSceneSettings settings;

  RandomScene(std::vector<GpuSolid> of, std::size_t count, std::uint32_t worlds, unsigned seed)
      : solids(std::move(of)), random_(seed) {
    const double side = 2 * std::cbrt(static_cast<double>(count) / worlds) + 1;
    for (std::size_t i = 0; i < count; ++i) {
      GpuSceneBody body;
      // Few are shapes, some of which are unbounded.
      const bool any = below(20) == 0;
      body.solid = static_cast<std::uint32_t>(any ? below(solids.size()) : 0);
      body.scale = below(3) == 0 ? std::exp2(uniform(-3, 2)) : 1;
      body.world = static_cast<std::uint32_t>(below(worlds));
      body.moves = below(3) != 0;
      if (below(4) == 0) body.layers = 1u << below(3);
      if (below(4) == 0) body.meets = static_cast<std::uint32_t>(below(8));
      bodies.push_back(body);
      poses.push_back({});
    }
    move(side);
    for (std::size_t k = 0; k < count / 4; ++k)
      excluded.push_back(
          {static_cast<std::uint32_t>(below(count)), static_cast<std::uint32_t>(below(count))});
    settings.max_pairs = 64 * count + 1;
    settings.margin = below(2) == 0 ? 0 : 0.25;
    settings.measure = below(2) == 0 ? Measure::matched : Measure::exact;
  }

  /// All, within a cube.
  void move(double side) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Pose& pose = poses[i];
      pose = {};
      for (double& x : pose.t) x = uniform(-side, side) / 2;
      switch (below(8)) {
        case 0:  // flush with others
          for (double& x : pose.t) x = 2 * std::round(x / 2);
          break;
        case 1:
          pose = poses[below(i + 1)];
          break;
        case 2:
          pose.q[below(4)] = below(9) == 0 ? std::numeric_limits<double>::quiet_NaN() : 0;
          break;
        case 3:
          pose.t[below(3)] = below(5) == 0 ? 1e39 : 1e5 * uniform(-1, 1);
          break;
        default:
          for (double& x : pose.q) x = uniform(-1, 1);
      }
    }
  }

  /// Pairs as Scene has them, and the bodies that it refuses.
  std::pair<NamedPairs, std::vector<std::uint32_t>> by_scene() const {
    NamedPairs pairs;
    std::vector<std::uint32_t> refused;
    std::uint32_t worlds = 0;
    for (const GpuSceneBody& body : bodies) worlds = std::max(worlds, body.world + 1);
    for (std::uint32_t world = 0; world < worlds; ++world) {
      Scene scene({.max_bodies = bodies.size() + 1, .max_pairs = settings.max_pairs});
      SceneRule rule;
      rule.answer = SceneAnswer::boxes;
      rule.margin = settings.margin;
      for (std::uint32_t a = 0; a < kSceneGroups; ++a)
        for (std::uint32_t b = a; b < kSceneGroups; ++b) scene.set_rule(a, b, rule);
      // A rule for a group without bodies: boxes are as wide as the widest rule needs.
      rule.answer = SceneAnswer::penetration;
      rule.penetration.measure = settings.measure;
      scene.set_rule(1, 1, rule);
      for (std::uint32_t i = 0; i < bodies.size(); ++i) {
        const GpuSceneBody& body = bodies[i];
        if (body.world != world) continue;
        SceneBody add;
        add.number = i;
        add.moves = body.moves;
        add.layers = body.layers;
        add.meets = body.meets;
        if (const auto* asset = std::get_if<AssetView>(&solids[body.solid]))
          add.solid = PlacedSolid(*asset, poses[i], body.scale);
        else
          add.solid = PlacedSolid(std::get<Shape>(solids[body.solid]), poses[i], body.scale);
        scene.add(add);
      }
      for (const ScenePairName& two : excluded) scene.exclude(two.a, two.b);
      const SceneStep step = scene.step();
      for (const ScenePair& pair : step.pairs) pairs.emplace_back(pair.a, pair.b);
      refused.insert(refused.end(), step.refused.begin(), step.refused.end());
    }
    std::sort(pairs.begin(), pairs.end());
    std::sort(refused.begin(), refused.end());
    return {std::move(pairs), std::move(refused)};
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::size_t below(std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_);
  }
  std::mt19937_64 random_;
};

}  // namespace ist::testing
