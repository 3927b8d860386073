// The broad phase of ist::Scene beside FCL's and Coal's DynamicAABBTreeCollisionManager and
// Bullet's btDbvtBroadphase: bodies that move a little in every step, and what their boxes meet.
// One thread, thread CPU time less the cost of the clock, the median of the steps.
//
// Floor of a step of 10,000 moving bodies, one in ten of which meets another: a body's pose (56
// bytes) is copied in 8 instructions, its box takes 170 vector instructions for four or eight
// bodies, 17 put it into the hierarchy; in a node of eight it is compared with seven, and a node
// with two others, in 50. That is 150 instructions with AVX2, and 300 bytes. A step takes 188
// instructions a body.

#include <btBulletDynamicsCommon.h>
#ifdef IST_HAVE_COAL
#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/collision_object.h>
#include <coal/shape/geometric_shapes.h>
#endif
#include <fcl/fcl.h>
#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/scene.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/bullet_mesh.h"
#include "timing.h"

namespace {

using ist::Pose;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;
using ist::testing::bullet_transform;

/// Cubes, of which the first `still` cannot move, and where the last ones stand in each step.
struct Course {
  std::vector<Pose> start;
  std::vector<double> edge;
  std::size_t still = 0;
  std::vector<std::vector<Pose>> steps;

  std::size_t size() const { return start.size(); }
};

/// Cubes of edge 1 in a larger one, one in ten of which has a box that meets another's; each
/// of the last `moved` goes on by up to 0.1 along each axis in a step.
Course jitter(std::size_t count, std::size_t still, std::size_t moved, int steps) {
  Course course;
  std::mt19937_64 random(7);
  // Two boxes of side 1 meet where their middles are within 1 along each axis: 8 u³.
  const double side = std::cbrt(80.0 * static_cast<double>(count));
  std::uniform_real_distribution<double> anywhere(0, side), near(-0.1, 0.1);
  course.start.resize(count);
  for (Pose& pose : course.start)
    for (double& x : pose.t) x = anywhere(random);
  course.edge.assign(count, 1);
  course.still = still;
  std::vector<Pose> now(course.start.end() - static_cast<std::ptrdiff_t>(moved),
                        course.start.end());
  for (int k = 0; k < steps; ++k) {
    for (Pose& pose : now)
      for (double& x : pose.t) x = std::clamp(x + near(random), 0.0, side);
    course.steps.push_back(now);
  }
  return course;
}

/// Cubes flush with each other, which are lifted by an eighth in each step.
Course block(std::size_t row, int steps) {
  Course course;
  for (std::size_t i = 0; i < row * row * row; ++i)
    course.start.push_back({{1, 0, 0, 0},
                            {static_cast<double>(i % row), static_cast<double>(i / row % row),
                             static_cast<double>(i / row / row)}});
  course.edge.assign(course.size(), 1);
  for (int k = 0; k < steps; ++k) {
    course.steps.push_back(k == 0 ? course.start : course.steps.back());
    for (Pose& pose : course.steps.back()) pose.t[2] += 0.125;
  }
  return course;
}

/// The scenes of Broadmark (Serpa and Rodrigues 2020), of turned cubes with edges from 0.5 to 1.5,
/// moved by Bullet: as they fall onto a floor, or about in a closed box as gravity turns.
Course simulated(std::size_t count, bool gravity_turns, int steps) {
  Course course;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> edges(0.5, 1.5), turns(-1, 1);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  const auto add = [&](std::unique_ptr<btCollisionShape> shape, btScalar mass,
                       const btTransform& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape.get(), inertia));
    bodies.back()->setWorldTransform(at);
    bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(bodies.back().get());
    shapes.push_back(std::move(shape));
  };
  const auto row = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(count))));
  constexpr double kApart = 2.5;
  for (std::size_t i = 0; i < count; ++i) {
    Pose pose = {
        {turns(random), turns(random), turns(random), turns(random)},
        {kApart * static_cast<double>(i % row), kApart * static_cast<double>(i / row % row),
         1 + kApart * static_cast<double>(i / row / row)}};
    const double norm =
        std::hypot(std::hypot(pose.q[0], pose.q[1]), std::hypot(pose.q[2], pose.q[3]));
    for (double& x : pose.q) x /= norm;
    course.start.push_back(pose);
    course.edge.push_back(edges(random));
    const auto half = static_cast<btScalar>(course.edge.back() / 2);
    add(std::make_unique<btBoxShape>(btVector3(half, half, half)), 1, bullet_transform(pose));
  }
  const btScalar wide = static_cast<btScalar>(kApart * static_cast<double>(row));
  for (int axis = 0; axis < 3; ++axis)
    for (const btScalar side : {1, -1}) {
      if (!gravity_turns && (axis < 2 || side < 0)) continue;  // the floor alone
      btVector3 normal(0, 0, 0);
      normal[axis] = side;
      add(std::make_unique<btStaticPlaneShape>(normal, side > 0 ? -kApart : -wide), 0,
          btTransform::getIdentity());
    }
  for (int k = 0; k < steps; ++k) {
    const auto angle = static_cast<btScalar>(0.1 * k);
    world.setGravity(gravity_turns ? btScalar(50) * btVector3(std::sin(angle), std::sin(angle / 2),
                                                              -std::cos(angle))
                                   : btVector3(0, 0, -10));
    for (int i = 0; i < 4; ++i) world.stepSimulation(btScalar(1) / 60, 0);
    std::vector<Pose>& now = course.steps.emplace_back(count);
    for (std::size_t i = 0; i < count; ++i) {
      const btTransform& at = bodies[i]->getWorldTransform();
      const btQuaternion q = at.getRotation();
      now[i] = {{q.w(), q.x(), q.y(), q.z()},
                {at.getOrigin().x(), at.getOrigin().y(), at.getOrigin().z()}};
    }
  }
  for (const auto& body : bodies) world.removeRigidBody(body.get());
  return course;
}

/// One of the peers: bodies are added once, and told where they stand.
struct Peer {
  virtual ~Peer() = default;
  virtual void add(const Course& course) = 0;
  /// The last bodies stand elsewhere. Returns the pairs whose boxes meet.
  virtual std::size_t step(std::span<const Pose> poses) = 0;
};

struct OfIst final : Peer {
  explicit OfIst(const ist::Asset& of) : cube(of) {}
  void add(const Course& course) override {
    scene = std::make_unique<ist::Scene>(ist::SceneSettings{.max_bodies = course.size(),
                                                            .max_pairs = 16 * course.size() + 1000,
                                                            .patches_per_pair = 1,
                                                            .workspace_capacity = 4096});
    ist::SceneRule rule;
    rule.answer = ist::SceneAnswer::boxes;
    rule.penetration.measure = ist::Measure::exact;
    scene->set_rule(0, 0, rule);
    for (std::size_t i = 0; i < course.size(); ++i) {
      ist::SceneBody body;
      body.number = static_cast<std::uint32_t>(i);
      numbers.push_back(body.number);
      body.solid = ist::PlacedSolid(cube.view(), course.start[i], course.edge[i]);
      body.moves = i >= course.still;
      scene->add(body);
    }
    scene->step();
  }
  std::size_t step(std::span<const Pose> poses) override {
    scene->set_poses(std::span(numbers).last(poses.size()), poses);
    return scene->step().pairs.size();
  }
  const ist::Asset& cube;
  std::unique_ptr<ist::Scene> scene;
  std::vector<std::uint32_t> numbers;
};

/// What FCL and Coal, which comes from it, call differently.
struct Fcl {
  using Object = fcl::CollisionObjectd;
  using Manager = fcl::DynamicAABBTreeCollisionManagerd;
  using Box = fcl::Boxd;
  static Eigen::Isometry3d transform(const Eigen::Isometry3d& at) { return at; }
  template <class... Others>
  static std::size_t pairs(Manager& manager, Others*... others) {
    std::size_t pairs = 0;
    manager.collide(others..., &pairs, [](Object* a, Object* b, void* data) {
      *static_cast<std::size_t*>(data) += a->getAABB().overlap(b->getAABB());
      return false;
    });
    return pairs;
  }
};

#ifdef IST_HAVE_COAL
struct Coal {
  using Object = coal::CollisionObject;
  using Manager = coal::DynamicAABBTreeCollisionManager;
  using Box = coal::Box;
  static coal::Transform3s transform(const Eigen::Isometry3d& at) {
    return coal::Transform3s(at.linear(), at.translation());
  }
  struct Count final : coal::CollisionCallBackBase {
    bool collide(Object* a, Object* b) override {
      pairs += a->getAABB().overlap(b->getAABB());
      return false;
    }
    std::size_t pairs = 0;
  };
  template <class... Others>
  static std::size_t pairs(Manager& manager, Others*... others) {
    Count count;
    manager.collide(others..., &count);
    return count.pairs;
  }
};
#endif

template <class Library>
struct OfManager final : Peer {
  void add(const Course& course) override {
    for (std::size_t i = 0; i < course.size(); ++i) {
      const double edge = course.edge[i];
      objects.push_back(std::make_unique<typename Library::Object>(
          std::make_shared<typename Library::Box>(edge, edge, edge)));
      place(i, course.start[i]);
      (i < course.still ? still : moving).registerObject(objects[i].get());
    }
    still.setup();
    moving.setup();
  }
  void place(std::size_t i, const Pose& pose) {
    objects[i]->setTransform(Library::transform(ist::to_isometry(pose)));
    objects[i]->computeAABB();
  }
  std::size_t step(std::span<const Pose> poses) override {
    const std::size_t first = objects.size() - poses.size();
    for (std::size_t i = 0; i < poses.size(); ++i) place(first + i, poses[i]);
    if (poses.size() > 1) {
      moving.update();
    } else {
      moving.update(objects[first].get());
    }
    std::size_t pairs = Library::pairs(moving);
    if (!still.empty()) pairs += Library::pairs(moving, &still);
    return pairs;
  }
  std::vector<std::unique_ptr<typename Library::Object>> objects;
  typename Library::Manager still, moving;
};

struct OfBullet final : Peer {
  void add(const Course& course) override {
    cache = std::make_unique<btHashedOverlappingPairCache>();
    broadphase = std::make_unique<btDbvtBroadphase>(cache.get());
    for (std::size_t i = 0; i < course.size(); ++i) {
      const bool is_still = i < course.still;
      const auto half = static_cast<btScalar>(course.edge[i] / 2);
      shapes.emplace_back(btVector3(half, half, half));
      btVector3 low, high;
      shapes[i].getAabb(bullet_transform(course.start[i]), low, high);
      // Those that stand still do not meet each other.
      proxies.push_back(broadphase->createProxy(low, high, 0, nullptr, is_still ? 2 : 1,
                                                is_still ? 1 : 3, nullptr));
    }
    broadphase->optimize();
    broadphase->calculateOverlappingPairs(nullptr);
  }
  std::size_t step(std::span<const Pose> poses) override {
    const std::size_t first = proxies.size() - poses.size();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      btVector3 low, high;
      shapes[first + i].getAabb(bullet_transform(poses[i]), low, high);
      broadphase->setAabb(proxies[first + i], low, high, nullptr);
    }
    broadphase->calculateOverlappingPairs(nullptr);
    return static_cast<std::size_t>(cache->getNumOverlappingPairs());
  }
  std::unique_ptr<btHashedOverlappingPairCache> cache;
  std::unique_ptr<btDbvtBroadphase> broadphase;
  std::vector<btBoxShape> shapes;
  std::vector<btBroadphaseProxy*> proxies;
};

/// Median time [µs] of a step, and the pairs of the last.
std::pair<double, std::size_t> median_step(Peer& peer, const Course& course) {
  static const double clock = ist::benchmark::clock_cost();
  peer.add(course);
  std::vector<double> us;
  std::size_t pairs = 0;
  for (const std::vector<Pose>& poses : course.steps) {
    const double start = thread_seconds();
    pairs = peer.step(poses);
    us.push_back(1e6 * (thread_seconds() - start - clock));
  }
  return {quantile(us, 0.5), pairs};
}

}  // namespace

int main(int argc, char** argv) {
  Report report("scene", argc, argv);
  report.page("Broad phases");
  report.remark(
      "Cubes. In the first rows they have edge 1, are not turned and move by up to 0.1 along each "
      "axis in a step; one in ten has a box that meets another's. In the block all are flush, and "
      "it is lifted by an eighth. The scenes after Broadmark (Serpa and Rodrigues 2020) are of "
      "turned cubes with edges from 0.5 to 1.5 that Bullet moved beforehand: they fall onto a "
      "floor, or about in a closed box as a strong gravity turns. One thread, thread CPU time less "
      "the cost of the clock, median of the steps. Bullet's pairs are those of its wider boxes; "
      "FCL's boxes around what "
      "is turned hold its bounding ball.");
  const ist::Asset cube = ist::bake_mesh_only(ist::close_mesh(ist::make_sample("cube"), "cube"));
  const std::size_t many = report.quick() ? 20'000 : 1'000'000, heap = report.quick() ? 300 : 4'000;
  const int steps = report.quick() ? 5 : 51;
  const std::pair<std::string, std::function<Course()>> cases[] = {
      {"all of 1,000 move", [&] { return jitter(1'000, 0, 1'000, steps); }},
      {"all of 10,000 move", [&] { return jitter(10'000, 0, 10'000, steps); }},
      {"1,000 in a block, flush, all move", [&] { return block(10, steps); }},
      {"one of 10,000 moves", [&] { return jitter(10'000, 0, 1, steps); }},
      {"100 move among those that stand still",
       [&] { return jitter(many + 100, many, 100, steps); }},
      {"free fall", [&] { return simulated(heap, false, steps); }},
      {"gravity that turns", [&] { return simulated(heap, true, steps); }}};
  for (const auto& [name, make] : cases) {
    const Course course = make();
    OfIst ist_scene(cube);
    OfManager<Fcl> fcl_manager;
    OfBullet bullet;
    Report::Json line = {{"case", name}, {"bodies", course.size()}};
    const auto [ist_us, ist_pairs] = median_step(ist_scene, course);
    const auto [fcl_us, fcl_pairs] = median_step(fcl_manager, course);
    const auto [bullet_us, bullet_pairs] = median_step(bullet, course);
    double best = std::min(fcl_us, bullet_us);
    line["pairs"] = ist_pairs;
    line["pairs, FCL"] = fcl_pairs;
    line["pairs, Bullet"] = bullet_pairs;
    line["ist us"] = ist_us;
    line["FCL us"] = fcl_us;
    line["Bullet us"] = bullet_us;
#ifdef IST_HAVE_COAL
    OfManager<Coal> coal_manager;
    const auto [coal_us, coal_pairs] = median_step(coal_manager, course);
    line["pairs, Coal"] = coal_pairs;
    line["Coal us"] = coal_us;
    best = std::min(best, coal_us);
#endif
    line["best peer / ist"] = best / ist_us;
    report.row("Steps", line);
  }
  return report.write();
}
