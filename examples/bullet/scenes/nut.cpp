#include <ist/mesh.h>

#include "scene_tools.h"

// mm, kg, s. A bolt stands on its head, a nut on its thread is let go: by its weight it turns down
// the thread. Both are bodies, nothing holds them but contacts. The threads leave 0.094 mm.

namespace {

constexpr double kPitch = 2, kLead = kPitch / (2 * std::numbers::pi);
constexpr double kSteel = 7.85e-6;
constexpr double kFit = 8;                 // [mm] of the bolt at which the nut fits unturned
constexpr double kBolt = 21;               // [mm] its length
constexpr double kFlanks = 60;             // [mm²] of thread that bear the nut
constexpr double kStart = 4.4, kEnd = 11;  // [mm] from the tip

}  // namespace

SceneResult run_nut(const SceneOptions& options) {
  const Part bolt("bolt", ist::load_mesh((options.meshes / "bolt.obj").string()), 4000);
  const Part nut("nut", ist::load_mesh((options.meshes / "nut.obj").string()), 4000);
  const double mass = kSteel * nut.volume();

  WorldSettings settings = world_settings(options, kGravityOfMillimetres);
  settings.margin = 0.01;
  settings.hulls = 64;
  set_law(settings, mass, kFlanks, 0.03, 100);
  if (options.way == Way::wrench) {
    // Little else than the thread holds the nut: it bears more than a body among many.
    settings.ist.law.stiffness =
        0.16 * ist::largest_stable_stiffness(settings.step, mass) / kFlanks;
  }
  SceneWorld world(settings);
  add_ground(world, 0.5);
  const Eigen::Isometry3d bolt_at = place({0, 0, kBolt}, turn(std::numbers::pi, {1, 0, 0}));
  btRigidBody& b = world.add(bolt, kSteel, bolt_at, 0.5);
  btRigidBody& n = world.add(
      nut, kSteel, bolt_at * place({0, 0, kStart}, turn((kStart - kFit) / kLead, {0, 0, 1})), 0);
  b.setFriction(0.5);
  // At 60 Hz it falls by more than its pitch in a step. Impacts keep it on the thread, but brake.
  const bool coarse = options.hz < 200;
  if (coarse) n.setCcdMotionThreshold(kPitch / 4);

  // Without friction the nut goes down the helix as a bead on a wire.
  const double inertia = nut.frame().unit_inertia.maxCoeff();
  const double acceleration = kGravityOfMillimetres / (1 + inertia / (kLead * kLead));

  Run run(world, options);
  double turned = 0, last = 0, off = 0, tilt = 0, way = 0;
  bool arrived = false;
  const double released =
      world.kinetic_energy() + world.potential_energy() + world.contact_energy();
  double most = 0;
  double seconds = 0;
  const auto look = [&] {
    if (arrived) return;
    const Eigen::Isometry3d in_bolt = world.mesh_frame(b).inverse() * world.mesh_frame(n);
    const double angle = std::atan2(in_bolt.linear()(1, 0), in_bolt.linear()(0, 0));
    const double start = (kStart - kFit) / kLead;
    turned += std::remainder(angle - (world.time() > 1.5 * settings.step ? last : start),
                             2 * std::numbers::pi);
    last = angle;
    way = in_bolt.translation().z() - kStart;
    off = std::max(off, std::abs(way - turned * kLead));
    tilt = std::max(tilt, angle_to_z(in_bolt));
    most = std::max(most, world.kinetic_energy() + world.potential_energy() +
                              world.contact_energy() - released);
    seconds = world.time();
    arrived = way > kEnd - kStart || !std::isfinite(way);
  };
  const double longest = options.seconds > 0 ? options.seconds : 1.2;
  while (!arrived && world.time() < longest) run.go(0.05, look);
  const double turns = turned / (2 * std::numbers::pi);
  const double ideal = 0.5 * acceleration * seconds * seconds;
  std::vector<Truth> truths = {{"turns", std::abs(turns), coarse ? 2.0 : 3.0, 4},
                               {"way over pitch times turns", way / (kPitch * turns), 0.97, 1.03},
                               {"farthest off the helix, of the pitch", off / kPitch, 0, 0.25},
                               {"tilt [rad]", tilt, 0, coarse ? 0.1 : 0.05}};
  if (!coarse) {
    truths.push_back({"way over that of a bead on the helix", way / ideal, 0.75, 1.1});
    truths.push_back({"energy gained, of what the way releases",
                      most / (mass * kGravityOfMillimetres * way), -kNone, 0.05});
  }
  return run.finish(kPitch, std::move(truths));
}
