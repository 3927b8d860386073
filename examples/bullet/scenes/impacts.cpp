#include <random>

#include "meshes.h"
#include "scene_tools.h"

// Solids of 0.1 m fall on a plane at every turn, in a heap, and are let go where they overlap: who
// leaves with more energy than he came with? Boxes lie over an edge, and fall through a sensor.

namespace {

/// Scaled to a largest extent of 0.1 m.
ist::TriangleMesh of_a_hand(ist::TriangleMesh mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(v);
  for (auto& v : mesh.vertices) v = 0.1 / box.sizes().maxCoeff() * (v - box.center());
  return mesh;
}

std::vector<Part> solids(const SceneOptions& options) {
  std::vector<std::pair<double, double>> ring;
  for (int i = 0; i < 16; ++i) {
    const double a = 2 * std::numbers::pi * i / 16;
    ring.emplace_back(0.035 + 0.015 * std::cos(a), 0.015 * std::sin(a));
  }
  const std::filesystem::path bunny = options.shared / "meshes/dev/bunny_60k.ply";
  std::vector<Part> all;
  all.emplace_back("box", make_box({0.05, 0.05, 0.05}), 1000);
  all.emplace_back("plate", make_box({0.05, 0.05, 0.005}), 1000);
  all.emplace_back("ring", make_turned(ring, 32), 1000);
  all.emplace_back("bolt", of_a_hand(ist::load_mesh((options.meshes / "bolt.obj").string())), 1000);
  all.emplace_back("bunny",
                   of_a_hand(ist::load_mesh(
                       (exists(bunny) ? bunny : options.meshes / "torus_knot.obj").string())),
                   1000);
  return all;
}

double kinetic_energy(const btRigidBody& body) {
  const btVector3 turning =
      body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
  double sum = 0.5 * body.getLinearVelocity().length2() / body.getInvMass();
  for (int k = 0; k < 3; ++k)
    sum += 0.5 * turning[k] * turning[k] / body.getInvInertiaDiagLocal()[k];
  return sum;
}

}  // namespace

SceneResult run_impacts(const SceneOptions& options) {
  const int turns = options.full ? 200 : 12;
  const std::vector<Part> parts = solids(options);
  WorldSettings settings = world_settings(options);
  settings.margin = 5e-4;
  set_law(settings, 0.1, 1e-3, 1e-4, 4);
  SceneWorld world(settings);
  add_ground(world, kFriction);

  struct Fall {
    btRigidBody* body;
    double before = 0, after = 0;  // [mass·u²/s²] about the height at which it meets the ground
    double height = 0;             // [u] then
    double energy = 0, was = 0;    // [mass·u²/s²], [u] in the last step
  };
  std::vector<Fall> falls;
  std::mt19937 random(3);
  const auto draw = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  for (const Part& part : parts) {
    double reach = 0;
    for (const auto& v : part.vertices_in_body()) reach = std::max(reach, v.norm());
    for (const double height : {0.1, 1.0, 10.0}) {
      for (int i = 0; i < turns; ++i) {
        const Eigen::Quaterniond way(draw(), draw(), draw(), draw());
        const auto n = static_cast<double>(falls.size());
        const Eigen::Isometry3d body =
            place({10 * std::fmod(n, 60), 10 * std::floor(n / 60), reach + 0.01 * (1 + draw())},
                  i == 0 ? Eigen::Quaterniond::Identity() : way.normalized());
        Fall fall;
        fall.body = &world.add(part, 1000, body * part.frame().in_mesh.inverse(), kFriction);
        fall.body->setLinearVelocity({0, 0, -std::sqrt(2 * kGravity * height)});
        falls.push_back(fall);
      }
    }
  }
  Run run(world, options);
  run.go(options.seconds > 0 ? options.seconds : 1.2, [&] {
    for (Fall& fall : falls) {
      const double z = fall.body->getCenterOfMassPosition().z(), mass = 1 / fall.body->getInvMass();
      const bool touches = world.contact_force(*fall.body).norm() > 0;
      if (touches && fall.before == 0) fall.before = fall.energy, fall.height = fall.was;
      fall.energy = kinetic_energy(*fall.body);
      fall.was = z;
      if (world.time() > 0.1 && fall.before > 0 && !touches)
        fall.after = std::max(fall.after, fall.energy + mass * kGravity * (z - fall.height));
    }
  });
  double worst = 0, gains = 0, lost = 0, sum = 0;
  for (const Fall& fall : falls) {
    const double share = fall.before > 0 ? fall.after / fall.before : 1;
    worst = std::max(worst, share);
    sum += share / static_cast<double>(falls.size());
    gains += share > 1;
    lost += !(fall.body->getCenterOfMassPosition().z() > 0);
  }
  return run.finish(0.1, {{"energy after over before, worst", worst, 0, 0.3},
                          {"the same, mean", sum, 0, 0.1},
                          {"falls that gain energy", gains, 0, 0},
                          {"bodies under the ground", lost, 0, 0}});
}

SceneResult run_overlap(const SceneOptions& options) {
  // Five boxes in each other: what Bullet's own boxes do is thrown 34 m.
  const Part box("box", make_box({0.1, 0.1, 0.1}), 4000);
  WorldSettings settings = world_settings(options);
  settings.margin = 5e-4;
  set_law(settings, 1, 0.04, 2e-4, 1);
  SceneWorld world(settings);
  add_ground(world, kFriction);
  std::vector<btRigidBody*> boxes;
  for (int i = 0; i < 5; ++i)
    boxes.push_back(&world.add(box, 125, place({0.02 * i, 0, 0.1 + 0.05 * i}), kFriction));
  double fastest = 0;
  Run run(world, options);
  run.go(options.seconds > 0 ? options.seconds : 5, [&] {
    for (const btRigidBody* body : boxes)
      fastest = std::max<double>(fastest, body->getLinearVelocity().length());
  });
  SceneResult result = run.finish(0.2, {{"fastest [m/s]", fastest, 0, 4}});
  result.truths.push_back({"kinetic energy, of weight times side",
                           result.kinetic_energy / (5 * kGravity * 0.2), 0, 1e-3});
  return result;
}

namespace {

SceneResult fill_crate(const SceneOptions& options, bool by_scene) {
  // A hundred solids fall into a crate of 0.5 m.
  constexpr double kHalf = 0.25, kWall = 0.05, kHigh = 1.5;
  const std::vector<Part> parts = solids(options);
  WorldSettings settings = world_settings(options);
  settings.margin = 5e-4;
  settings.hulls = 0;
  settings.by_scene = by_scene;
  set_law(settings, 0.1, 1e-3, 1e-4, 4);
  SceneWorld world(settings);
  add_ground(world, kFriction);
  for (const double sign : {-1.0, 1.0}) {
    const double at = sign * (kHalf + kWall);
    world.add_still(std::make_unique<btBoxShape>(btVector3(kWall, kHalf + 2 * kWall, kHigh)),
                    place({at, 0, kHigh}), kFriction);
    world.add_still(std::make_unique<btBoxShape>(btVector3(kHalf + 2 * kWall, kWall, kHigh)),
                    place({0, at, kHigh}), kFriction);
  }
  std::mt19937 random(7);
  const auto draw = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  std::vector<btRigidBody*> bodies;
  double highest = 0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Quaterniond way(draw(), draw(), draw(), draw());
    highest = 0.12 + 0.16 * (i / 9);
    const Eigen::Vector3d at(0.15 * (i % 3 - 1) + 0.01 * draw(),
                             0.15 * (i / 3 % 3 - 1) + 0.01 * draw(), highest);
    const Part& part = parts[static_cast<std::size_t>(i) % parts.size()];
    bodies.push_back(&world.add(part, 1000, place(at, way.normalized()), kFriction));
    // Half of the plate: in a step at 60 Hz a body moves by more than its size.
    if (options.hz < 100) bodies.back()->setCcdMotionThreshold(0.005);
  }
  double fastest = 0;
  Run run(world, options);
  run.go(options.seconds > 0 ? options.seconds : 4, [&] {
    for (const btRigidBody* body : bodies)
      fastest = std::max<double>(fastest, body->getLinearVelocity().length());
  });
  double moving = 0, lost = 0;
  for (const btRigidBody* body : bodies) {
    const btVector3& at = body->getCenterOfMassPosition();
    moving += body->getLinearVelocity().length() > 0.02;
    lost += !(at.z() > 0 && std::max(std::abs(at.x()), std::abs(at.y())) < kHalf);
  }
  return run.finish(0.1,
                    {{"fastest, of free fall", fastest / std::sqrt(2 * kGravity * highest), 0, 1},
                     {"bodies out of the crate", lost, 0, 0},
                     {"bodies faster than 2 cm/s at the end", moving, 0, 0}});
}

}  // namespace

SceneResult run_heap(const SceneOptions& options) { return fill_crate(options, false); }
SceneResult run_crate(const SceneOptions& options) { return fill_crate(options, true); }

SceneResult run_edge(const SceneOptions& options) {
  // Boxes lie over a table's edge by a share of their side: 0.5 is true.
  constexpr double kSide = 0.2;
  const Part box("box", make_box(Eigen::Vector3d::Constant(kSide / 2)), 4000);
  WorldSettings settings = world_settings(options);
  settings.margin = 5e-4;
  settings.hulls = 1;
  set_law(settings, 5, kSide * kSide, 2e-4, 1);
  SceneWorld world(settings);
  std::vector<std::pair<double, btRigidBody*>> boxes;
  for (int i = 0; i < 15; ++i) {
    const double over = 0.38 + 0.01 * i, y = 2 * kSide * i;
    world.add_still(std::make_unique<btBoxShape>(btVector3(kSide / 2, kSide / 2, kSide / 2)),
                    place({0, y, -kSide / 2}), kFriction);
    boxes.emplace_back(over,
                       &world.add(box, kWood, place({kSide * over, y, kSide / 2}), kFriction));
  }
  Run run(world, options);
  run.go(options.seconds > 0 ? options.seconds : 5);
  double most = 0, least = 1;
  for (const auto& [over, body] : boxes) {
    const bool there = body->getCenterOfMassPosition().z() > 0.4 * kSide;
    if (there) most = std::max(most, over);
    if (!there) least = std::min(least, over);
  }
  return run.finish(kSide, {{"furthest over the edge that stands, of the side", most, 0.47, 0.501},
                            {"least that falls", least, 0.479, 0.511}});
}

namespace {

int begun, ended;

}  // namespace

SceneResult run_sensor(const SceneOptions& options) {
  // A box falls through a larger one that is a sensor, and another begins inside a third.
  const Part box("box", make_box({0.05, 0.05, 0.05}), 1000);
  const Part room("room", make_box({0.3, 0.3, 0.3}), 1000);
  WorldSettings settings = world_settings(options, 9.81);
  settings.margin = 5e-4;
  settings.hulls = 1;
  SceneWorld world(settings);
  const auto sensor = [&](double x) {
    btRigidBody& body = world.add(room, 0, place({x, 0, 0}), kFriction);
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  };
  sensor(0);
  sensor(2);
  const double drop = 0.6;
  btRigidBody& falls = world.add(box, kWood, place({0, 0, drop}), kFriction);
  btRigidBody& stays = world.add(box, kWood, place({2, 0, 0}), kFriction);
  stays.setGravity({0, 0, 0});
  begun = ended = 0;
  gContactStartedCallback = [](btPersistentManifold* const&) { ++begun; };
  gContactEndedCallback = [](btPersistentManifold* const&) { ++ended; };
  Run run(world, options);
  const double seconds = options.seconds > 0 ? options.seconds : 0.6;
  run.go(seconds);
  gContactStartedCallback = nullptr;
  gContactEndedCallback = nullptr;
  const double speed = -falls.getLinearVelocity().z() / (kGravity * seconds);
  return run.finish(
      0.1, {{"contacts begun", static_cast<double>(begun), 2, 2},
            {"contacts ended", static_cast<double>(ended), 1, 1},
            {"speed at the end, of free fall", speed, 0.999, 1.001},
            {"speed of what began inside [m/s]", stays.getLinearVelocity().length(), 0, 1e-9}});
}
