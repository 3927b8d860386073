#include <gtest/gtest.h>
#include <ist/scene.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "scene/body_box.h"
#include "support/answer_bits.h"
#include "support/baked.h"
#include "support/float_traps.h"
#include "support/surface_queries.h"
#include "support/test_meshes.h"

// Compares scenes with single queries of all pairs.

namespace ist {
namespace {

using namespace testing;
using Numbers = std::pair<std::uint32_t, std::uint32_t>;

const Asset& block() {
  static const Asset asset = bake_mesh_only(closed(box_mesh({-1, -1, -1}, {1, 1, 1}), "block"), 1);
  return asset;
}
const Asset& ball() {
  static const Asset asset = baked(icosphere_mesh(2), "ball", 60);
  return asset;
}

/// All threads at once, whatever the pool's size.
void run_threads(void*, std::size_t workers, void (*work)(void*, std::size_t), void* batch) {
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < workers; ++i) threads.emplace_back(work, batch, i);
  for (std::thread& one : threads) one.join();
}

struct Answer {
  ScenePair pair;
  Penetration penetration;
  Separation separation;
  TimeOfImpact impact;
};
Answer answer_of(const Scene& scene, const ScenePair& pair) {
  return {pair, scene.penetration(pair), scene.separation(pair), scene.impact(pair)};
}

std::uint64_t bits_of(const Answer& answer, std::span<const ContactPatch> patches) {
  const ScenePair& pair = answer.pair;
  AnswerBits bits;
  bits.add(std::uint64_t{pair.a} << 32 | pair.b);
  bits.add(std::uint64_t{static_cast<std::uint32_t>(pair.event)} << 32 |
           static_cast<std::uint32_t>(pair.overlapping));
  bits.add(answer.penetration);
  bits.add(answer.separation);
  bits.add(answer.impact);
  for (const ContactPatch& patch : patches) bits.add(patch);
  return bits.value();
}
/// For two bodies without an answer a scene reports only that their boxes meet.
bool is_answered(const Answer& pair) {
  return pair.pair.overlapping == YesNo::yes || pair.impact.kind != ImpactKind::no_impact ||
         pair.impact.status == QueryStatus::budget_exhausted ||
         (pair.pair.overlapping == YesNo::unknown && pair.penetration.status == QueryStatus::ok &&
          pair.separation.status == QueryStatus::ok &&
          (pair.penetration.touching || pair.penetration.volume > 0 ||
           pair.separation.distance > 0));
}
std::vector<std::uint64_t> answered(const Scene& scene, const SceneStep& step) {
  std::vector<std::uint64_t> out;
  for (const ScenePair& pair : step.pairs) {
    Answer answer = answer_of(scene, pair);
    if (!is_answered(answer)) continue;
    answer.pair.event = SceneEvent::begins;
    out.push_back(bits_of(answer, scene.patches(pair)));
  }
  for (const std::uint32_t number : step.refused) out.push_back(number);
  return out;
}
std::vector<std::uint64_t> bits_of(const Scene& scene, const SceneStep& step) {
  std::vector<std::uint64_t> out;
  for (const ScenePair& pair : step.pairs)
    out.push_back(bits_of(answer_of(scene, pair), scene.patches(pair)));
  for (const ScenePairName& pair : step.ended) out.push_back(std::uint64_t{pair.a} << 32 | pair.b);
  for (const std::uint32_t number : step.refused) out.push_back(number);
  return out;
}

/// The rules of a random scene: by exact with a margin, patches, yes or no, impacts, nothing.
SceneRule rule_of(std::uint32_t a, std::uint32_t b) {
  PenetrationSettings exact;
  exact.measure = Measure::exact;
  switch ((a + b) % 6) {
    case 0:
      return {SceneAnswer::penetration, exact, 0.25};
    case 1:
      return {SceneAnswer::patches, exact, 0};
    case 2:
      return {SceneAnswer::overlap, {}, 0.1};
    case 3:
      return {SceneAnswer::penetration, exact, 0};
    case 4:
      return {SceneAnswer::impact, {}, 0, {.duration = 0.5, .tolerance = a == b ? 0 : 0.01}};
    default:
      return {SceneAnswer::nothing, {}, 0};
  }
}
void set_rules(Scene& scene) {
  for (std::uint32_t a = 0; a < 4; ++a)
    for (std::uint32_t b = a; b < 4; ++b) scene.set_rule(a, b, rule_of(a, b));
}

/// Poses as people have them as often as random ones.
class Pile {
 public:
  explicit Pile(unsigned seed) : random_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::uint32_t below(std::uint32_t most) {
    return std::uniform_int_distribution<std::uint32_t>(0, most - 1)(random_);
  }
  Pose pose() {
    Pose out;
    const bool on_lattice = below(2) == 0;
    for (double& x : out.t) x = on_lattice ? below(5) * 2.0 - 4 : uniform(-5, 5);
    if (!on_lattice)
      for (double& x : out.q) x = uniform(-1, 1);
    if (below(40) == 0) out.t[1] = std::numeric_limits<double>::quiet_NaN();
    if (below(40) == 0) out.t[0] = 1e40;
    return out;
  }
  ist::Motion motion() {
    ist::Motion out;
    for (auto* const x : {&out.velocity, &out.angular_velocity, &out.about})
      if (below(3) != 0) *x = {uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)};
    return out;
  }
  SceneBody body(std::uint32_t number) {
    SceneBody out;
    out.number = number;
    const std::uint32_t kind = below(12);
    const double scale = below(3) == 0 ? uniform(0.3, 2) : 1.0;
    if (kind == 0)
      out.solid = PlacedSolid(Shape(HalfSpaceShape{{0, 0, 1}, -4}), Pose{});
    else if (kind == 1)
      out.solid = PlacedSolid(Shape(BoxShape{{1, 0.5, 2}}), pose(), scale);
    else
      out.solid = PlacedSolid(kind < 7 ? block().view() : ball().view(), pose(), scale);
    out.moves = below(3) != 0;
    out.group = below(4);
    if (below(2) == 0) out.motion = motion();
    if (below(4) == 0) out.layers = 2;
    if (below(4) == 0) out.meets = 1;
    return out;
  }

 private:
  std::mt19937 random_;
};

/// The content of a scene, and the expected pairs.
class AllPairs {
 public:
  std::map<std::uint32_t, SceneBody> bodies;
  std::set<Numbers> excluded;

  std::vector<std::uint64_t> step() {
    std::vector<std::uint64_t> out;
    met_ = 0;
    std::vector<std::uint32_t> refused;
    for (const auto& [number, body] : bodies)
      if (is_refused(body.solid)) refused.push_back(number);
    for (auto a = bodies.begin(); a != bodies.end(); ++a)
      for (auto b = std::next(a); b != bodies.end(); ++b) {
        if (!asks(a->second, b->second)) continue;
        Answer pair;
        if (!answer(a->second, b->second, pair)) continue;
        if (!is_answered(pair)) continue;
        ++met_;
        out.push_back(bits_of(pair, {patches_.data(), pair.pair.patch_count}));
      }
    for (const std::uint32_t number : refused) out.push_back(number);
    return out;
  }
  std::size_t met() const { return met_; }

 private:
  static bool is_refused(const PlacedSolid& solid) {
    if (const auto* field = std::get_if<PlacedShape>(&solid.placed))
      if (std::holds_alternative<HalfSpaceShape>(field->shape) && std::isfinite(field->pose.t[1]))
        return false;
    const Pose pose = std::visit([](const auto& placed) { return placed.pose; }, solid.placed);
    for (const double x : pose.t)
      if (!std::isfinite(x) || std::abs(x) > 1e37) return true;
    return false;
  }
  bool asks(const SceneBody& a, const SceneBody& b) const {
    const auto is_field = [](const SceneBody& body) {
      return std::holds_alternative<PlacedShape>(body.solid.placed);
    };
    return (a.moves || b.moves) && (a.layers & b.meets) != 0 && (b.layers & a.meets) != 0 &&
           excluded.count({a.number, b.number}) == 0 && !(is_field(a) && is_field(b)) &&
           !is_refused(a.solid) && !is_refused(b.solid) &&
           rule_of(a.group, b.group).answer != SceneAnswer::nothing;
  }
  bool answer(const SceneBody& a, const SceneBody& b, Answer& out) {
    const SceneRule rule = rule_of(a.group, b.group);
    out.pair.a = a.number;
    out.pair.b = b.number;
    if (rule.answer == SceneAnswer::impact) {
      out.impact = time_of_impact(a.solid, b.solid, {a.motion, b.motion}, rule.impact, workspace_);
      return out.impact.kind != ImpactKind::no_impact || out.impact.status != QueryStatus::ok;
    }
    if (rule.answer == SceneAnswer::overlap) {
      out.pair.overlapping = overlap(a.solid, b.solid, rule.margin, workspace_).answer;
      return out.pair.overlapping != YesNo::no;
    }
    if (rule.answer == SceneAnswer::patches) {
      const ContactPatches found =
          contact_patches(a.solid, b.solid, rule.penetration, workspace_, patches_);
      out.penetration = found.penetration;
      out.pair.patch_count = static_cast<std::uint32_t>(found.count);
    } else {
      out.penetration = penetration(a.solid, b.solid, rule.penetration, workspace_);
    }
    bool meet = out.penetration.touching || out.penetration.status != QueryStatus::ok ||
                out.penetration.volume > 0;
    if (rule.margin > 0 && (rule.penetration.measure == Measure::matched ||
                            std::isnan(out.penetration.volume) || out.penetration.volume == 0)) {
      SeparationSettings limits;
      limits.max_distance = rule.margin;
      out.separation = separation(a.solid, b.solid, limits, workspace_);
      meet |= out.separation.status != QueryStatus::ok || out.separation.distance_min < rule.margin;
    }
    return meet;
  }

  std::size_t met_ = 0;
  Workspace workspace_;
  std::vector<ContactPatch> patches_ = std::vector<ContactPatch>(8);
};

TEST(Scene, FindsWhatAllPairsHave) {
  const std::array<AssetView, 2> assets = {block().view(), ball().view()};
  std::size_t met = 0;
  const char* const wanted = std::getenv("IST_SCENES");  // ./dev soak scenes
  const unsigned scenes = wanted == nullptr ? 40 : static_cast<unsigned>(std::stoul(wanted));
  for (unsigned seed = 1; seed <= scenes; ++seed) {
    Pile pile(seed);
    Scene scene({.max_bodies = 60, .workers = 1});
    // The same bodies, added in reverse order, by several threads.
    Scene other({.max_bodies = 60, .workers = 3});
    set_rules(scene);
    set_rules(other);
    AllPairs all;
    std::set<Numbers> before;
    for (std::uint32_t i = 0; i < 50; ++i) all.bodies[7 * i + 3] = pile.body(7 * i + 3);
    for (auto& [number, body] : all.bodies) scene.add(body);
    for (auto at = all.bodies.rbegin(); at != all.bodies.rend(); ++at) other.add(at->second);
    for (int step = 0; step < 8; ++step) {
      SCOPED_TRACE(std::to_string(seed) + " step " + std::to_string(step));
      const std::vector<std::byte> record = scene.record();
      Scene again = Scene::replay(record, assets, 2);
      const SceneStep found = scene.step();
      const auto bits = bits_of(scene, found);
      EXPECT_EQ(bits, bits_of(again, again.step()));
      EXPECT_EQ(bits, bits_of(other, other.step({run_threads, nullptr})));
      const auto truth = all.step();
      EXPECT_EQ(answered(scene, found), truth);
      met += all.met();
      // Every pair that met in the step before stays or ended.
      std::set<Numbers> now, left = before;
      for (const ScenePair& pair : found.pairs) {
        now.insert({pair.a, pair.b});
        EXPECT_EQ(left.erase({pair.a, pair.b}) == 1, pair.event == SceneEvent::stays);
      }
      std::set<Numbers> ended;
      for (const ScenePairName& pair : found.ended) ended.insert({pair.a, pair.b});
      EXPECT_EQ(ended, left);
      before = std::move(now);
      // Some move, few or many; some go, some come, some are joined.
      const std::uint32_t most = step % 2 == 0 ? 3 : 50;
      std::vector<std::uint32_t> numbers;
      for (const auto& [number, body] : all.bodies) numbers.push_back(number);
      for (std::uint32_t i = 0; i < most; ++i) {
        const std::uint32_t number =
            numbers[pile.below(static_cast<std::uint32_t>(numbers.size()))];
        const Pose pose = pile.pose();
        std::visit([&](auto& placed) { placed.pose = pose; }, all.bodies[number].solid.placed);
        EXPECT_TRUE(scene.set_pose(number, pose));
        EXPECT_TRUE(other.set_pose(number, pose));
        if (i % 4 != 0) continue;
        const ist::Motion motion = all.bodies[number].motion = pile.motion();
        EXPECT_EQ(scene.set_motions({&number, 1}, {&motion, 1}), 1u);
        EXPECT_EQ(other.set_motions({&number, 1}, {&motion, 1}), 1u);
      }
      const std::uint32_t gone = numbers[pile.below(static_cast<std::uint32_t>(numbers.size()))];
      all.bodies.erase(gone);
      EXPECT_TRUE(scene.remove(gone));
      EXPECT_TRUE(other.remove(gone));
      EXPECT_FALSE(scene.remove(gone));
      const std::uint32_t come =
          pile.below(2) == 0 ? gone : 1000 + static_cast<std::uint32_t>(step);
      all.bodies[come] = pile.body(come);
      scene.add(all.bodies[come]);
      other.add(all.bodies[come]);
      const Numbers joined{numbers[0], numbers[1]};
      if (step % 3 == 1) {
        scene.exclude(joined.second, joined.first);
        other.exclude(joined.first, joined.second);
        all.excluded.insert(joined);
      } else if (step % 3 == 2) {
        for (const Numbers& pair : all.excluded) {
          scene.include(pair.first, pair.second);
          other.include(pair.second, pair.first);
        }
        all.excluded.clear();
      }
    }
  }
  EXPECT_GT(met, 3'000u);
}

SceneBody block_at(std::uint32_t number, double x, bool moves = true) {
  SceneBody out;
  out.number = number;
  out.solid = PlacedSolid(block().view(), Pose{{1, 0, 0, 0}, {x, 0, 0}});
  out.moves = moves;
  return out;
}
SceneRule exact_rule(double margin = 0) {
  SceneRule rule;
  rule.penetration.measure = Measure::exact;
  rule.margin = margin;
  return rule;
}

TEST(Scene, BoxesOfAllSizesMeetWhereTheirNumbersSay) {
  std::size_t met = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Pile pile(seed);
    const std::uint32_t count = 100 * (1u << 2 * (seed % 3));
    Scene scene({.max_bodies = count, .max_pairs = 400'000});
    SceneRule rule;
    rule.answer = SceneAnswer::boxes;
    scene.set_rule(0, 0, rule);
    std::map<std::uint32_t, SceneBody> bodies;
    const auto body = [&](std::uint32_t number) {
      // All bodies move, and their blocks are placed at once, or not all do.
      SceneBody out = block_at(number, 0, seed % 2 == 0 || pile.below(3) != 0);
      // A floor, and bodies 1e4 times as small; in a corner, or on a lattice.
      const double size = number == 0 ? 10 : std::exp2(pile.uniform(-10, seed % 2 == 0 ? 0 : -3));
      out.solid = PlacedSolid(block().view(), pile.pose(), size);
      return out;
    };
    for (std::uint32_t i = 0; i < count; ++i) scene.add(bodies[i] = body(i));
    for (int step = 0; step < 4; ++step) {
      SCOPED_TRACE(std::to_string(seed) + " step " + std::to_string(step));
      std::vector<Numbers> found, wanted;
      for (const ScenePair& pair : scene.step().pairs) found.emplace_back(pair.a, pair.b);
      std::vector<SceneBox> boxes(count);
      std::vector<bool> has(count);
      for (const auto& [i, one] : bodies)
        has[i] = BodyBox(one.solid).place(std::get<PlacedAsset>(one.solid.placed).pose,
                                          {.by_spheres = true}, {}, boxes[i]) == Place::tree;
      for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t j = i + 1; j < count; ++j) {
          bool meet = has[i] && has[j] && (bodies[i].moves || bodies[j].moves);
          for (std::size_t c = 0; c < 3; ++c)
            meet =
                meet && boxes[i].low[c] <= boxes[j].high[c] && boxes[j].low[c] <= boxes[i].high[c];
          if (meet) wanted.emplace_back(i, j);
        }
      EXPECT_EQ(found, wanted);
      met += wanted.size();
      // All move in a row, some of them twice, or some one by one, some of which are other bodies.
      std::vector<std::uint32_t> numbers;
      std::vector<Pose> poses;
      for (std::uint32_t i = 0; i < count; ++i) {
        if (step % 2 == 1 && pile.below(5) != 0) continue;
        if (step % 2 == 1 && pile.below(2) == 0) {
          EXPECT_TRUE(scene.remove(i));
          scene.add(bodies[i] = body(i));
        }
        numbers.push_back(i);
        poses.push_back(pile.pose());
      }
      if (step == 2)
        for (const std::uint32_t first : {3u, 8u, 16u, 8u})
          for (std::uint32_t i = first; i < first + 8; ++i) {
            numbers.push_back(i);
            poses.push_back(pile.pose());
          }
      for (std::size_t k = 0; k < numbers.size(); ++k)
        std::get<PlacedAsset>(bodies[numbers[k]].solid.placed).pose = poses[k];
      EXPECT_EQ(scene.set_poses(numbers, poses), numbers.size());
    }
  }
  EXPECT_GT(met, 10'000u);
}

TEST(Scene, ProtrudingSpheresAreNoOverlap) {
  const Asset cube = testing::baked(testing::cube_mesh(), "cube", 300);
  Scene scene;
  SceneRule rule;
  rule.margin = 0.5;
  scene.set_rule(0, 0, rule);
  for (std::uint32_t number : {0u, 1u}) {
    SceneBody body;
    body.number = number;
    body.solid = PlacedSolid(cube.view(), Pose{{1, 0, 0, 0}, {1.001 * number, 0, 0}});
    scene.add(body);
  }
  const SceneStep step = scene.step();
  ASSERT_EQ(step.pairs.size(), 1u);
  EXPECT_GT(scene.penetration(step.pairs[0]).volume, 0);
  EXPECT_NEAR(scene.separation(step.pairs[0]).distance, 0.001, 1e-9);
}

TEST(Scene, TouchingBlocksMeetAndApartOnesComeWithinTheMargin) {
  Scene scene;
  scene.set_rule(0, 0, exact_rule(0.5));
  scene.add(block_at(1, 0, false));
  scene.add(block_at(2, 2));
  scene.add(block_at(5, 4.25));
  const SceneStep step = scene.step();
  ASSERT_EQ(step.pairs.size(), 2u);
  EXPECT_TRUE(scene.penetration(step.pairs[0]).touching);
  EXPECT_NEAR(scene.penetration(step.pairs[0]).contact_area, 4, 1e-12);
  const Eigen::Vector3d centre = scene.penetration(step.pairs[0]).centroid;
  EXPECT_LE((centre - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_EQ(step.pairs[1].a, 2u);
  EXPECT_NEAR(scene.separation(step.pairs[1]).distance, 0.25, 1e-12);
  EXPECT_EQ(step.pairs[1].event, SceneEvent::begins);
  EXPECT_EQ(scene.step().pairs[1].event, SceneEvent::stays);
  scene.set_pose(5, {{1, 0, 0, 0}, {9, 0, 0}});
  const SceneStep apart = scene.step();
  ASSERT_EQ(apart.ended.size(), 1u);
  EXPECT_EQ(apart.ended[0].a, 2u);
  EXPECT_EQ(apart.ended[0].b, 5u);
}

TEST(Scene, ExclusionsEndWithTheirBodies) {
  Scene scene;
  scene.set_rule(0, 0, exact_rule());
  for (const std::uint32_t number : {0u, 1u, 2u}) scene.add(block_at(number, 0));
  scene.exclude(0, 1);
  scene.exclude(2, 0);
  EXPECT_EQ(scene.step().pairs.size(), 1u);
  scene.remove(1);
  scene.add(block_at(1, 0));  // another body of the same number
  const ist::SceneStep step = scene.step();
  ASSERT_EQ(step.pairs.size(), 2u);
  EXPECT_EQ(step.pairs[0].b, 1u);  // 0 and 1; 0 and 2 are still excluded
  EXPECT_EQ(step.pairs[1].a, 1u);
}

TEST(Scene, PairsWithoutRoomAreToldAndAskedAgain) {
  Scene scene({.max_bodies = 8, .max_pairs = 2});
  scene.set_rule(0, 0, exact_rule());
  for (std::uint32_t i = 0; i < 3; ++i) scene.add(block_at(i, 0.5 * i));
  const SceneStep full = scene.step();
  EXPECT_TRUE(full.pairs_exceeded);
  EXPECT_TRUE(full.pairs.empty());
  scene.set_pose(2, {{1, 0, 0, 0}, {2.25, 0, 0}});
  const SceneStep step = scene.step();
  EXPECT_FALSE(step.pairs_exceeded);
  EXPECT_EQ(step.pairs.size(), 2u);
}

TEST(Scene, MistakesAreTold) {
  EXPECT_THROW(Scene({.workers = 0}), Error);
  Scene scene({.max_bodies = 2});
  scene.add(block_at(1, 0));
  EXPECT_THROW(scene.add(block_at(1, 3)), Error);
  SceneBody grouped = block_at(2, 0);
  grouped.group = kSceneGroups;
  EXPECT_THROW(scene.add(grouped), Error);
  scene.add(block_at(2, 9));
  EXPECT_THROW(scene.add(block_at(3, 0)), Error);
  EXPECT_THROW(scene.set_rule(0, kSceneGroups, {}), Error);
  EXPECT_THROW(scene.set_rule(0, 0, exact_rule(-1)), Error);
  EXPECT_THROW(scene.set_rule(0, 0, {.answer = static_cast<SceneAnswer>(6)}), Error);
  EXPECT_THROW(scene.set_rule(0, 0, {.penetration = {.measure = static_cast<Measure>(3)}}), Error);
  EXPECT_FALSE(scene.set_pose(7, {}));
  EXPECT_EQ(scene.size(), 2u);
  // An invalid query is not a miss.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Ray& ray : {Ray{.origin = {0, nan, 0}}, Ray{.direction = {0, 0, 0}},
                         Ray{.max_distance = 0}, Ray{.max_distance = nan}}) {
    const SceneHit found = scene.raycast(ray);
    EXPECT_EQ(found.hit.status, QueryStatus::invalid_input);
    EXPECT_TRUE(std::isnan(found.hit.distance));
  }
  for (const SceneNearest& found : {scene.nearest({0, 0, nan}), scene.nearest({0, 0, 0}, nan)}) {
    EXPECT_EQ(found.surface.status, QueryStatus::invalid_input);
    EXPECT_TRUE(std::isnan(found.surface.distance));
  }
}

TEST(Scene, ShapesOutOfRangeAreRefused) {
  const NoFloatTraps divided_by_zero;
  Scene scene;
  scene.add(block_at(0, 0));
  const std::vector<Shape> shapes = {
      HalfSpaceShape{{0, 0, 0}, 0}, BoxShape{{1, -1, 1}}, BallShape{-1},       CapsuleShape{-1, 1},
      CylinderShape{1, 0},          HeightFieldShape{},   DistanceGridShape{}, FunctionShape{}};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    SceneBody body;
    body.number = static_cast<std::uint32_t>(i + 1);
    body.solid = PlacedSolid(shapes[i], {});
    scene.add(body);
  }
  const SceneStep step = scene.step();
  EXPECT_TRUE(step.pairs.empty());
  EXPECT_EQ(step.refused.size(), shapes.size());
}

TEST(Scene, RaysAndBoxesMeetTheSameBodiesAsOneByOne) {
  Pile pile(5);
  Scene scene({.max_bodies = 300});
  std::map<std::uint32_t, SceneBody> bodies;
  for (std::uint32_t i = 0; i < 300; ++i) {
    SceneBody body = block_at(i, 0, i % 2 == 0);
    body.solid = PlacedSolid(block().view(), pile.pose(), 0.3);
    bodies[i] = body;
    scene.add(body);
  }
  int hits = 0;
  for (int k = 0; k < 300; ++k) {
    Ray ray;
    for (int c = 0; c < 3; ++c)
      ray.origin[c] = pile.below(2) == 0 ? 2.0 * pile.below(4) - 4 : pile.uniform(-6, 6);
    ray.direction = Eigen::Vector3d::Zero();
    ray.direction[static_cast<int>(pile.below(3))] = 1;
    if (k % 2 == 0) ray.direction = {pile.uniform(-1, 1), pile.uniform(-1, 1), pile.uniform(-1, 1)};
    SceneHit best;
    for (const auto& [number, body] : bodies) {
      const RayHit hit = raycast(body.solid, ray);
      if (hit.status == QueryStatus::ok && hit.distance < best.hit.distance) best = {number, hit};
    }
    const SceneHit found = scene.raycast(ray);
    EXPECT_EQ(found.hit.distance, best.hit.distance);
    if (best.hit.hit()) {
      EXPECT_EQ(found.number, best.number);
    }
    hits += best.hit.hit() ? 1 : 0;
  }
  EXPECT_GT(hits, 50);
  int inside = 0;
  for (int k = 0; k < 300; ++k) {
    Eigen::Vector3d point;
    for (int c = 0; c < 3; ++c)
      point[c] = pile.below(2) == 0 ? 2.0 * pile.below(4) - 4 : pile.uniform(-6, 6);
    const double reach = k % 3 == 0 ? pile.uniform(-0.1, 1) : HUGE_VAL;
    SceneNearest best;
    for (const auto& [number, body] : bodies) {
      const SurfacePoint here = closest_point(body.solid, point);
      if (here.status == QueryStatus::ok && here.distance <= reach &&
          here.distance < best.surface.distance)
        best = {number, here};
    }
    const SceneNearest found = scene.nearest(point, reach);
    EXPECT_EQ(found.surface.distance, best.surface.distance);
    EXPECT_EQ(found.number, best.number);
    inside += found.surface.distance < 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 5);
  std::vector<std::uint32_t> numbers(300);
  const std::size_t all = scene.in_box({-9, -9, -9}, {9, 9, 9}, numbers);
  EXPECT_GT(all, 200u);
  EXPECT_EQ(scene.in_box({50, 50, 50}, {51, 51, 51}, numbers), 0u);
  EXPECT_EQ(scene.in_box({-9, -9, -9}, {9, 9, 9}, {}), all);
}

}  // namespace
}  // namespace ist
