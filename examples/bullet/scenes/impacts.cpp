#include <random>

#include "meshes.h"
#include "scene_tools.h"

// Solids of 0.1 m fall on a plane at every turn, and are let go where they overlap: who leaves with
// more energy than he came with?

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
            place({0.5 * std::fmod(n, 60), 0.5 * std::floor(n / 60), reach + 0.01 * (1 + draw())},
                  i == 0 ? Eigen::Quaterniond::Identity() : way.normalized());
        Fall fall;
        fall.body = &world.add(part, 1000, body * part.frame().in_mesh.inverse(), kFriction);
        fall.body->setLinearVelocity({0, 0, -std::sqrt(2 * kGravity * height)});
        falls.push_back(fall);
      }
    }
  }
  Run run(world, options);
  run.go(options.seconds > 0 ? options.seconds : 0.6, [&] {
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
