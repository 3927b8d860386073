// The broad phase of ist::Scene beside FCL's DynamicAABBTreeCollisionManager and Bullet's
// btDbvtBroadphase: bodies that move a little in every step, and what their boxes meet. One thread,
// thread CPU time, the median of the steps; all three are told the same boxes.
//
// Floor of a step of 10,000 moving bodies, one in ten of which meets another: 560 kB of boxes are
// written and read, and a descent of the hierarchy with itself compares some 30 boxes a body, 3 ns
// each: 1 ms. Of the boxes themselves (a rotation of a half-extent) 40 ns each are 0.4 ms.

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <fcl/fcl.h>
#include <ist/bake.h>
#include <ist/mass_properties.h>
#include <ist/scene.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "mesh/samples/samples.h"
#include "report.h"
#include "timing.h"

namespace {

using ist::Pose;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;

/// Balls of diameter 1 in a cube, of which the first `still` do not move.
struct Bodies {
  std::vector<Pose> poses;
  std::size_t still;
  bool on_lattice;
  double side;
  std::mt19937_64 random{7};

  /// `meeting`: share of them that meets another; 0: they lie on a lattice, flush with each other.
  Bodies(std::size_t count, std::size_t still_ones, double meeting)
      : still(still_ones), on_lattice(meeting == 0) {
    // Two boxes of side 1 meet where their middles are within 1 along each axis: 8 u³.
    side = std::cbrt((on_lattice ? 1.0 : 8 / meeting) * static_cast<double>(count));
    if (on_lattice) {
      const auto row = static_cast<std::size_t>(std::ceil(side));
      for (std::size_t i = 0; i < count; ++i)
        poses.push_back({{1, 0, 0, 0},
                         {static_cast<double>(i % row), static_cast<double>(i / row % row),
                          static_cast<double>(i / row / row)}});
      return;
    }
    std::uniform_real_distribution<double> uniform(0, side);
    poses.resize(count);
    for (Pose& pose : poses)
      for (double& x : pose.t) x = uniform(random);
  }
  /// Bodies first … last go on a little, within the cube; on a lattice all by the same, upwards.
  void move(std::size_t first, std::size_t last) {
    if (on_lattice) {
      for (std::size_t i = first; i < last; ++i) poses[i].t[2] += 0.125;
      return;
    }
    std::uniform_real_distribution<double> uniform(-0.1, 0.1);
    for (std::size_t i = first; i < last; ++i)
      for (double& x : poses[i].t) x = std::clamp(x + uniform(random), 0.0, side);
  }
};

/// One of the three: bodies are added once, and told where they stand.
struct Peer {
  virtual ~Peer() = default;
  virtual void add(const Bodies& bodies) = 0;
  /// Bodies first … last moved. Returns the pairs whose boxes meet.
  virtual std::size_t step(const Bodies& bodies, std::size_t first, std::size_t last) = 0;
};

struct OfIst final : Peer {
  explicit OfIst(const ist::Asset& of)
      : asset(of),
        scale(1 / (ist::bounds(of.view()).upper - ist::bounds(of.view()).lower).maxCoeff()) {}
  void add(const Bodies& bodies) override {
    scene = std::make_unique<ist::Scene>(
        ist::SceneSettings{.max_bodies = bodies.poses.size(),
                           .max_pairs = 16 * bodies.poses.size() + 1000,
                           .patches_per_pair = 1,
                           .workspace_capacity = 4096});
    ist::SceneRule rule;
    rule.answer = ist::SceneAnswer::boxes;
    rule.penetration.measure = ist::Measure::exact;
    scene->set_rule(0, 0, rule);
    for (std::size_t i = 0; i < bodies.poses.size(); ++i) {
      ist::SceneBody body;
      body.number = static_cast<std::uint32_t>(i);
      numbers.push_back(body.number);
      body.solid = ist::PlacedSolid(asset.view(), bodies.poses[i], scale);
      body.moves = i >= bodies.still;
      scene->add(body);
    }
    scene->step();
  }
  std::size_t step(const Bodies& bodies, std::size_t first, std::size_t last) override {
    scene->set_poses({numbers.data() + first, last - first},
                     {bodies.poses.data() + first, last - first});
    return scene->step().pairs.size();
  }
  const ist::Asset& asset;
  const double scale;
  std::unique_ptr<ist::Scene> scene;
  std::vector<std::uint32_t> numbers;
};

struct OfFcl final : Peer {
  void add(const Bodies& bodies) override {
    const auto ball = std::make_shared<fcl::Sphered>(0.5);
    for (std::size_t i = 0; i < bodies.poses.size(); ++i) {
      objects.push_back(std::make_unique<fcl::CollisionObjectd>(ball));
      place(bodies, i);
      (i < bodies.still ? still : moving).registerObject(objects[i].get());
    }
    still.setup();
    moving.setup();
  }
  void place(const Bodies& bodies, std::size_t i) {
    const double* const t = bodies.poses[i].t;
    objects[i]->setTranslation({t[0], t[1], t[2]});
    objects[i]->computeAABB();
  }
  std::size_t step(const Bodies& bodies, std::size_t first, std::size_t last) override {
    for (std::size_t i = first; i < last; ++i) place(bodies, i);
    if (last - first > 1) {
      moving.update();
    } else {
      moving.update(objects[first].get());
    }
    std::size_t pairs = 0;
    const auto count = [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
      if (a->getAABB().overlap(b->getAABB())) ++*static_cast<std::size_t*>(data);
      return false;
    };
    moving.collide(&pairs, count);
    if (!still.empty()) moving.collide(&still, &pairs, count);
    return pairs;
  }
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
  fcl::DynamicAABBTreeCollisionManagerd still, moving;
};

struct OfBullet final : Peer {
  void add(const Bodies& bodies) override {
    cache = std::make_unique<btHashedOverlappingPairCache>();
    broadphase = std::make_unique<btDbvtBroadphase>(cache.get());
    for (std::size_t i = 0; i < bodies.poses.size(); ++i) {
      const bool is_still = i < bodies.still;
      const auto [low, high] = box(bodies, i);
      // Those that stand still do not meet each other.
      proxies.push_back(broadphase->createProxy(low, high, 0, nullptr, is_still ? 2 : 1,
                                                is_still ? 1 : 3, nullptr));
    }
    broadphase->optimize();
    broadphase->calculateOverlappingPairs(nullptr);
  }
  static std::pair<btVector3, btVector3> box(const Bodies& bodies, std::size_t i) {
    const double* const t = bodies.poses[i].t;
    const btVector3 middle(static_cast<btScalar>(t[0]), static_cast<btScalar>(t[1]),
                           static_cast<btScalar>(t[2]));
    const btVector3 half(0.5, 0.5, 0.5);
    return {middle - half, middle + half};
  }
  std::size_t step(const Bodies& bodies, std::size_t first, std::size_t last) override {
    for (std::size_t i = first; i < last; ++i) {
      const auto [low, high] = box(bodies, i);
      broadphase->setAabb(proxies[i], low, high, nullptr);
    }
    broadphase->calculateOverlappingPairs(nullptr);
    return static_cast<std::size_t>(cache->getNumOverlappingPairs());
  }
  std::unique_ptr<btHashedOverlappingPairCache> cache;
  std::unique_ptr<btDbvtBroadphase> broadphase;
  std::vector<btBroadphaseProxy*> proxies;
};

/// Median time [µs] of a step, and the pairs of the last.
std::pair<double, std::size_t> median_step(Peer& peer, Bodies bodies, std::size_t moved,
                                           int steps) {
  peer.add(bodies);
  std::vector<double> us;
  std::size_t pairs = 0;
  const std::size_t count = bodies.poses.size();
  for (int i = 0; i < steps; ++i) {
    bodies.move(count - moved, count);
    const double start = thread_seconds();
    pairs = peer.step(bodies, count - moved, count);
    us.push_back(1e6 * (thread_seconds() - start));
  }
  return {quantile(us, 0.5), pairs};
}

}  // namespace

int main(int argc, char** argv) {
  Report report("scene", argc, argv);
  report.page("Broad phases");
  report.remark(
      "Balls of diameter 1, each moved by up to 0.1 along each axis in a step; one body in ten has "
      "a box that meets another's. In the block all are flush, and it is lifted by an eighth. One "
      "thread, thread CPU time, median of the steps. Bullet's pairs "
      "are those of its wider boxes.");
  const ist::Asset ball =
      ist::bake_mesh_only(ist::close_mesh(ist::make_sample("sphere"), "sphere"));
  struct Case {
    const char* name;
    std::size_t bodies, still, moved;
    double meeting = 0.1;
  };
  const std::size_t many = report.quick() ? 20'000 : 1'000'000;
  const Case cases[] = {{"all of 1,000 move", 1'000, 0, 1'000},
                        {"all of 10,000 move", 10'000, 0, 10'000},
                        {"1,000 in a block, flush, all move", 1'000, 0, 1'000, 0},
                        {"one of 10,000 moves", 10'000, 0, 1},
                        {"100 move among those that stand still", many + 100, many, 100}};
  for (const Case& one : cases) {
    const Bodies bodies(one.bodies, one.still, one.meeting);
    const int steps = report.quick() ? 5 : 51;
    OfIst ist_scene(ball);
    OfFcl fcl_manager;
    OfBullet bullet;
    Report::Json line = {{"case", one.name}, {"bodies", one.bodies}};
    const auto [ist_us, ist_pairs] = median_step(ist_scene, bodies, one.moved, steps);
    const auto [fcl_us, fcl_pairs] = median_step(fcl_manager, bodies, one.moved, steps);
    const auto [bullet_us, bullet_pairs] = median_step(bullet, bodies, one.moved, steps);
    line["pairs"] = ist_pairs;
    line["pairs, FCL"] = fcl_pairs;
    line["pairs, Bullet"] = bullet_pairs;
    line["ist us"] = ist_us;
    line["FCL us"] = fcl_us;
    line["Bullet us"] = bullet_us;
    line["best peer / ist"] = std::min(fcl_us, bullet_us) / ist_us;
    report.row("Steps", line);
  }
  return report.write();
}
