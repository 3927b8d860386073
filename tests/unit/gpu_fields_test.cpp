#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include <ist/types.h>

#include "query/ball_triangle/disc.h"
#include "query/base/relative_pose.h"

#include "support/host_patches.h"
#include "support/host_separations.h"
#include "support/oracle_assets.h"
#include "support/random_pairs.h"
#include "support/reference_sum.h"
#include "support/surface_queries.h"

// The GPU's batch of trees in fields, its source run by teams of the host, against the CPU's query.

namespace ist::testing {
namespace {

/// All that a GPU knows.
std::vector<std::pair<const char*, Shape>> batch_fields() {
  std::vector<std::pair<const char*, Shape>> out = fields();
  std::erase_if(out, [](const auto& f) { return std::holds_alternative<FunctionShape>(f.second); });
  return out;
}

/// Trees and fields as the solids of a batch.
std::vector<GpuSolid> with_fields(std::vector<GpuSolid> trees, const std::vector<Shape>& fields) {
  for (const Shape& field : fields) trees.emplace_back(field);
  return trees;
}

/// batch_solids() and batch_fields(): field f is solid kFirstField + f.
constexpr std::uint32_t kFirstField = 4;
std::vector<GpuSolid> mixed_solids() {
  std::vector<Shape> all;
  for (const auto& [name, field] : batch_fields()) all.push_back(field);
  EXPECT_EQ(batch_solids().size(), kFirstField);
  return with_fields(batch_solids(), all);
}

/// Random poses of a field and random trees, near it more often than not.
std::vector<BatchPair> pairs_with(std::uint32_t field, std::size_t count, unsigned seed) {
  RandomPairs random(seed);
  std::vector<BatchPair> out = random.pairs(count);
  for (BatchPair& pair : out) {
    pair.a = kFirstField + field;
    pair.scale_b *= random.uniform(0.1, 0.5);
    pair.pose_a = random.pose(0.3);
  }
  return out;
}

Penetration by_cpu(const Shape& field, const BatchPair& pair, Measure measure) {
  static Workspace workspace;
  PenetrationSettings settings;
  settings.measure = measure;
  return penetration(PlacedShape{field, pair.pose_a, pair.scale_a},
                     PlacedAsset{batch_assets()[pair.b].view(), pair.pose_b, pair.scale_b},
                     settings, workspace);
}

/// Errors of an answer, relative to the larger of its volume and 1e-6 size³, and to the area and
/// lever that belong to it.
struct FieldOff {
  double volume = 0, push = 0, turn = 0, centre = 0;

  void look(const Penetration& gpu, const Penetration& cpu, double size) {
    const double volume_scale = std::max(cpu.volume, 1e-6 * size * size * size);
    const double area = std::max(std::cbrt(volume_scale * volume_scale), cpu.force.norm());
    volume = std::max(volume, std::abs(gpu.volume - cpu.volume) / volume_scale);
    push = std::max(push, (gpu.force - cpu.force).norm() / area);
    turn = std::max(turn, (gpu.torque - cpu.torque).norm() / (area * size));
    if (cpu.volume > volume_scale / 2)
      centre = std::max(centre, (gpu.centroid - cpu.centroid).norm() / size);
  }
};

TEST(GpuFields, AnswersAreTheCpus) {
  const auto named = batch_fields();
  HostBatch batch(mixed_solids());
  for (std::uint32_t f = 0; f < named.size(); ++f) {
    FieldOff off;
    std::size_t met = 0, crossed = 0;
    for (const Measure measure : {Measure::matched, Measure::inner}) {
      const std::vector<BatchPair> pairs = pairs_with(f, 300, 30 + f);
      const std::vector<Penetration> answers = batch.run(pairs, measure);
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Penetration cpu = by_cpu(named[f].second, pairs[i], measure);
        ASSERT_EQ(answers[i].status, QueryStatus::ok);
        off.look(answers[i], cpu, pairs[i].scale_b);
        met += cpu.volume > 0 ? 1 : 0;
        crossed += cpu.force.norm() > 0 ? 1 : 0;
      }
    }
    std::printf("%-15s volume %.1e push %.1e turn %.1e centroid %.1e; %zu met, %zu crossed\n",
                named[f].first, off.volume, off.push, off.turn, off.centre, met, crossed);
    EXPECT_GT(crossed, 50u) << named[f].first;
    EXPECT_LE(off.volume, 1e-9) << named[f].first;
    EXPECT_LE(off.push, 1e-9) << named[f].first;
    EXPECT_LE(off.turn, 1e-9) << named[f].first;
    EXPECT_LE(off.centre, 1e-9) << named[f].first;
  }
}

/// Centres of balls on planes, edges and corners of the field.
TEST(GpuFields, AlignedSolidsToo) {
  static const std::vector<float> flat(81, 0.0f);
  const std::vector<Shape> fields = {BoxShape{Eigen::Vector3d(0.5, 0.5, 0.5)}, terrain_of(flat, 9),
                                     HalfSpaceShape{}};
  HostBatch batch(with_fields({cube().view(), batch_assets()[3].view()}, fields));
  std::vector<BatchPair> pairs;
  for (std::uint32_t f = 0; f < fields.size(); ++f) {
    for (const double scale : {0.25, 0.5, 1.0, 2.0}) {
      for (int i = 0; i < 27; ++i) {
        BatchPair pair;
        pair.a = 2 + f;
        pair.b = static_cast<std::uint32_t>(i % 2);
        pair.scale_b = scale;
        for (int k = 0, n = i; k < 3; ++k, n /= 3) pair.pose_b.t[k] = 0.5 * (n % 3) - 0.25 * scale;
        pairs.push_back(pair);
      }
    }
  }
  const std::vector<Penetration> by_warp = batch.run(pairs, Measure::matched, 7);
  const std::vector<Penetration> by_one = batch.run(pairs, Measure::matched);
  Workspace workspace;
  FieldOff off;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const BatchPair& pair = pairs[i];
    const Asset& body = pair.b == 0 ? cube() : batch_assets()[3];
    const Penetration cpu =
        penetration(PlacedShape{fields[pair.a - 2], pair.pose_a, 1},
                    PlacedAsset{body.view(), pair.pose_b, pair.scale_b}, {}, workspace);
    off.look(by_one[i], cpu, pair.scale_b);
    off.look(by_warp[i], cpu, pair.scale_b);
  }
  EXPECT_LE(off.volume, 1e-9);
  EXPECT_LE(off.push, 1e-9);
  EXPECT_LE(off.centre, 1e-9);
}

/// A ball whose centre lies on an edge does not determine its side of a triangle.
TEST(GpuFields, CentresOnEdges) {
  static const std::vector<float> slope = [] {
    std::vector<float> h;
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i) h.push_back(static_cast<float>(0.125 * std::abs(i - 4)));
    return h;
  }();
  const Asset& body = batch_assets()[3];
  const std::vector<Shape> fields = {BoxShape{Eigen::Vector3d(0.5, 0.5, 0.5)},
                                     terrain_of(slope, 9)};
  const std::vector<std::vector<Eigen::Vector3d>> edges = {
      {{0.5, 0.5, 0.1}, {0.5, 0.5, 0.5}, {-0.5, 0.1, 0.5}, {0.5, 0.125, 0.125}},
      {{1, 0.3, 0}, {0.5, 0.5, 0.25}, {0.625, 0.125, 0.1875}, {1, 1, 0}}};
  std::vector<BatchPair> pairs;
  for (std::uint32_t f = 0; f < fields.size(); ++f) {
    for (const Eigen::Vector3d& edge : edges[f]) {
      for (const WorldSphere& ball : world_spheres({body.view(), Pose{}, 0.5}, Measure::matched)) {
        BatchPair pair;
        pair.a = 1 + f;
        pair.scale_b = 0.5;
        for (int k = 0; k < 3; ++k) pair.pose_b.t[k] = edge[k] - ball.centre[k];
        pairs.push_back(pair);
      }
    }
  }
  HostBatch batch(with_fields({body.view()}, fields));
  const std::vector<Penetration> by_warp = batch.run(pairs, Measure::matched, 7);
  const std::vector<Penetration> by_one = batch.run(pairs, Measure::matched);
  Workspace workspace;
  FieldOff off;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Penetration cpu =
        penetration(PlacedShape{fields[pairs[i].a - 1], {}, 1},
                    PlacedAsset{body.view(), pairs[i].pose_b, pairs[i].scale_b}, {}, workspace);
    off.look(by_one[i], cpu, 0.5);
    off.look(by_warp[i], cpu, 0.5);
  }
  EXPECT_LE(off.volume, 1e-9);
  EXPECT_LE(off.push, 1e-9);
  EXPECT_LE(off.turn, 1e-9);
  EXPECT_LE(off.centre, 1e-9);
}

/// Leaves with more triangles than are tested at a time, more balls that meet them than are held,
/// and some of these on edges: what is put right asks for the triangles again meanwhile.
TEST(GpuFields, CentresOnEdgesOfManyTriangles) {
  constexpr std::uint32_t kPoints = 65;
  std::vector<float> ridges;
  for (std::uint32_t i = 0; i < kPoints * kPoints; ++i)
    ridges.push_back(i % kPoints % 2 == 0 ? 0.0f : 0.03125f);
  const Asset& body = cube();
  const std::vector<WorldSphere> balls = world_spheres({body.view(), Pose{}, 1}, Measure::matched);
  HeightFieldShape terrain = terrain_of(ridges, kPoints);
  terrain.spacing[0] = terrain.spacing[1] = 0.03125;
  const std::vector<Shape> fields = {terrain};
  std::vector<BatchPair> pairs;
  for (std::size_t i = 0; i < balls.size(); i += 100) {
    BatchPair pair;
    pair.a = 1;
    const double edge[3] = {1.03125, 1.015625, 0.03125};
    for (int k = 0; k < 3; ++k) pair.pose_b.t[k] = edge[k] - balls[i].centre[k];
    pairs.push_back(pair);
  }
  HostBatch batch(with_fields({body.view()}, fields));
  const std::vector<Penetration> by_warp = batch.run(pairs, Measure::matched, 7);
  Workspace workspace;
  FieldOff off;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    off.look(by_warp[i],
             penetration(PlacedShape{fields[0], {}, 1},
                         PlacedAsset{body.view(), pairs[i].pose_b, 1}, {}, workspace),
             1);
  EXPECT_LE(off.volume, 1e-9);
  EXPECT_LE(off.push, 1e-9);
  EXPECT_LE(off.turn, 1e-9);
  EXPECT_LE(off.centre, 1e-9);
}

/// From a hair to many times the field's size, by a tree of four levels.
TEST(GpuFields, ProbesOfAnySize) {
  static const Asset many = baked(torus_mesh(1, 0.4, 48, 24), "torus", 4500, false);
  const std::vector<Shape> fields = {BoxShape{Eigen::Vector3d(0.5, 0.4, 0.3)}};
  HostBatch batch(with_fields({many.view()}, fields));
  for (const double scale : {1e-7, 1e-5, 1e-3, 0.03, 0.1, 0.3, 3.0, 30.0}) {
    RandomPairs random(17);
    std::vector<BatchPair> pairs;
    for (int i = 0; i < 24; ++i) {
      BatchPair pair;
      pair.a = 1;
      pair.scale_b = scale;
      pair.pose_b = random.pose(1);
      const double on_box[3] = {random.uniform(-0.5, 0.5), 0.4, random.uniform(-0.3, 0.3)};
      for (int k = 0; k < 3; ++k)
        pair.pose_b.t[k] = on_box[k] + 0.7 * scale * random.uniform(-1, 1);
      pairs.push_back(pair);
    }
    const std::vector<Penetration> by_warp = batch.run(pairs, Measure::matched, 3);
    const std::vector<Penetration> by_one = batch.run(pairs, Measure::matched);
    Workspace workspace;
    FieldOff off;
    int met = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Penetration cpu =
          penetration(PlacedShape{fields[pairs[i].a - 1], {}, 1},
                      PlacedAsset{many.view(), pairs[i].pose_b, scale}, {}, workspace);
      off.look(by_one[i], cpu, scale);
      off.look(by_warp[i], cpu, scale);
      met += cpu.force.norm() > 0 ? 1 : 0;
    }
    std::printf("%8g: volume %.1e push %.1e turn %.1e centroid %.1e; %d crossed\n", scale,
                off.volume, off.push, off.turn, off.centre, met);
    EXPECT_GE(met, 5) << scale;
    // A probe's place has the precision of the field's coordinates.
    const double allowed = std::max(1e-11, 1e-15 / scale);
    EXPECT_LE(off.volume, allowed) << scale;
    EXPECT_LE(off.push, allowed) << scale;
    EXPECT_LE(off.turn, allowed) << scale;
    EXPECT_LE(off.centre, allowed) << scale;
  }
}

TEST(GpuFields, LanesOfAWarpNeedNoLuck) {
  HostBatch batch(mixed_solids());
  const auto count = static_cast<std::uint32_t>(batch_fields().size());
  std::vector<BatchPair> pairs;
  for (std::uint32_t f = 0; f < count; ++f)
    for (const BatchPair& pair : pairs_with(f, 12, 50 + f)) pairs.push_back(pair);
  const std::vector<Penetration> by_one = batch.run(pairs, Measure::matched);
  const std::vector<Penetration> by_warp = batch.run(pairs, Measure::matched, 1);
  expect_same_bits(batch.run(pairs, Measure::matched, 2), by_warp);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double size = pairs[i].scale_b;
    EXPECT_NEAR(by_warp[i].volume, by_one[i].volume, 1e-11 * (by_one[i].volume + size));
    EXPECT_EQ(by_warp[i].sphere_pairs, by_one[i].sphere_pairs) << i;
    EXPECT_EQ(by_warp[i].node_visits, by_one[i].node_visits) << i;
  }
}

/// However many rounds there are, and whether pairs fit into one.
TEST(GpuFields, CapacityChangesNoBit) {
  const auto count = static_cast<std::uint32_t>(batch_fields().size());
  std::vector<BatchPair> pairs;
  for (std::uint32_t f = 0; f < count; ++f)
    for (const BatchPair& pair : pairs_with(f, 80, 90 + f)) pairs.push_back(pair);
  for (std::uint32_t f = 0; f < count; ++f) {  // and some of which much meets
    BatchPair pair = pairs_with(f, 1, 90)[0];
    pair.pose_b = pair.pose_a;
    pair.scale_b = 2;
    for (pair.b = 0; pair.b < batch_solids().size(); ++pair.b) pairs.push_back(pair);
  }
  HostBatch roomy(mixed_solids());
  roomy.query_capacity = static_cast<std::uint32_t>(pairs.size());
  roomy.part_capacity = 100 * roomy.query_capacity;
  roomy.word_capacity = 10000 * roomy.query_capacity;
  const std::vector<Penetration> expected = roomy.run(pairs, Measure::matched, 1);
  EXPECT_EQ(roomy.rounds, 1u);
  const auto large = [](const HostBatch& batch) { return batch.field_counters.large; };
  EXPECT_GT(roomy.field_counters.listed[gpu::kFacets], 30u);

  struct Capacities {
    const char* of;
    std::uint32_t queries, parts, words, most_rounds;
    bool more_are_large, many_rounds;
  };
  for (const Capacities& capacities : {Capacities{"few pairs", 3, 300, 30000, ~0u, false, true},
                                       Capacities{"few parts", 40, 5, 30000, ~0u, true, false},
                                       Capacities{"few words", 40, 300, 520, ~0u, true, true},
                                       Capacities{"few rounds", 5, 300, 30000, 2, false, false},
                                       Capacities{"none", 5, 300, 30000, 0, false, false}}) {
    HostBatch batch(mixed_solids());
    batch.query_capacity = capacities.queries;
    batch.part_capacity = capacities.parts;
    batch.word_capacity = capacities.words;
    batch.most_rounds = capacities.most_rounds;
    SCOPED_TRACE(capacities.of);
    expect_same_bits(batch.run(pairs, Measure::matched, 1), expected);
    EXPECT_EQ(large(batch) > large(roomy), capacities.more_are_large) << large(batch);
    EXPECT_EQ(batch.rounds > 20, capacities.many_rounds) << batch.rounds;
  }
}

TEST(GpuFields, InvalidInputSpoilsOnlyItself) {
  std::vector<GpuSolid> solids = mixed_solids();
  const auto count = static_cast<std::uint32_t>(batch_fields().size());
  std::vector<BatchPair> pairs;
  for (int i = 0; i < 8; ++i)
    for (std::uint32_t f = 0; f < count; ++f) pairs.push_back(pairs_with(f, 1, 70 + f)[0]);
  const std::vector<Penetration> sound = HostBatch(solids).run(pairs, Measure::matched);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<float> holes(27, std::numeric_limits<float>::quiet_NaN());
  solids =
      with_fields(solids, {BallShape{-1}, BoxShape{Eigen::Vector3d(1, 0, 1)},
                           HalfSpaceShape{Eigen::Vector3d::Zero(), 0},
                           HeightFieldShape{nullptr, 9, 9}, grid_of(holes, 3), CapsuleShape{0, 1}});
  std::vector<std::size_t> bad = {3, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41};
  pairs[3].pose_b.t[1] = nan;
  pairs[7].pose_a.q[0] = nan;
  pairs[11].scale_b = 0;
  pairs[13].scale_a = -1;
  pairs[17].a = 1000;
  pairs[19].b = 99;
  for (std::uint32_t k = 0; k < 5; ++k) {
    pairs[bad[6 + k]].a = kFirstField + count + k;
    pairs[bad[6 + k]].pose_b = pairs[bad[6 + k]].pose_a;
  }
  bad.push_back(43);
  pairs[43].a = kFirstField + count + 5;
  const std::vector<Penetration> answers = HostBatch(solids).run(pairs, Measure::matched);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool is_bad = std::find(bad.begin(), bad.end(), i) != bad.end();
    EXPECT_EQ(answers[i].status, is_bad ? QueryStatus::invalid_input : QueryStatus::ok) << i;
    EXPECT_EQ(std::isnan(answers[i].volume), is_bad) << i;
    if (!is_bad) {
      EXPECT_EQ(answers[i].volume, sound[i].volume) << i;
    }
    if (!is_bad || pairs[i].b >= batch_solids().size() || pairs[i].a >= solids.size()) continue;
    const Penetration cpu = by_cpu(std::get<Shape>(solids[pairs[i].a]), pairs[i], Measure::matched);
    EXPECT_EQ(cpu.status, QueryStatus::invalid_input) << i;
    EXPECT_TRUE(std::isnan(cpu.volume)) << i;
  }
  EXPECT_TRUE(HostBatch(solids).run({}, Measure::inner).empty());
}

/// Pairs of trees, and of a tree and a field in either order, in one batch.
TEST(GpuFields, ABatchMixesPairsInAnyOrder) {
  const std::vector<GpuSolid> solids = mixed_solids();
  const std::vector<BatchPair> of_trees = RandomPairs(19).pairs(40);
  std::vector<BatchPair> of_fields, pairs;
  for (std::uint32_t f = 0; kFirstField + f < solids.size(); ++f)
    for (const BatchPair& pair : pairs_with(f, 24, 190 + f)) of_fields.push_back(pair);
  std::vector<Penetration> expected = HostBatch(batch_solids()).run(of_trees, Measure::matched, 1);
  pairs = of_trees;
  std::size_t crossed = 0;
  const std::vector<Penetration> first = HostBatch(solids).run(of_fields, Measure::matched, 1);
  for (std::size_t i = 0; i < of_fields.size(); ++i) {
    const BatchPair& pair = of_fields[i];
    pairs.push_back(pair);
    pairs.push_back({pair.b, pair.a, pair.pose_b, pair.pose_a, pair.scale_b, pair.scale_a});
    expected.insert(expected.end(), 2, first[i]);
    turn_over(pair.pose_b, pair.pose_a, expected.back());
    crossed += first[i].torque.norm() > 0 ? 1 : 0;
  }
  EXPECT_GT(crossed, 20u);
  expect_same_bits(HostBatch(solids).run(pairs, Measure::matched, 1), expected);
}

/// Two fields have no spheres, and a query of two trees takes no field.
TEST(GpuFields, WhatHoldsNoSpheresIsNotHeld) {
  const std::vector<GpuSolid> solids = mixed_solids();
  std::vector<BatchPair> pairs(4);
  pairs[1].a = pairs[2].b = pairs[3].a = kFirstField;
  pairs[1].b = kFirstField + 1;
  const std::vector<Penetration> volumes = HostBatch(solids).run(pairs, Measure::matched);
  const std::vector<Separation> gaps = HostSeparations(solids).run(pairs);
  const std::vector<PatchedPair> patches = HostPatches(solids).run(pairs, Measure::matched, 4);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto held = [](bool yes) { return yes ? QueryStatus::ok : QueryStatus::missing_data; };
    EXPECT_EQ(volumes[i].status, held(i != 1)) << i;
    EXPECT_EQ(std::isnan(volumes[i].volume), i == 1) << i;
    EXPECT_EQ(gaps[i].status, held(i == 0)) << i;
    EXPECT_EQ(std::isnan(gaps[i].distance), i != 0) << i;
    EXPECT_EQ(patches[i].whole.status, held(i == 0)) << i;
    EXPECT_EQ(patches[i].patches.empty(), i != 0) << i;
  }
}

TEST(GpuFields, WhatABatchCannotHoldIsNamed) {
  const auto said = [](const GpuSolid& last) -> std::string {
    try {
      HostSolids({cube().view(), last});
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  FunctionShape function;
  function.sample = [](const void*, const Eigen::Vector3d&) noexcept { return ShapeSample{}; };
  EXPECT_EQ(said(Shape(function)).find("GPU: solid 1 is a FunctionShape"), 0u);
  EXPECT_EQ(said(AssetView{}), "GPU: solid 1 is an empty asset");
}

}  // namespace
}  // namespace ist::testing
