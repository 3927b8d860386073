#include <ist/query.h>

#include <random>

#include "meshes.h"
#include "scene_tools.h"

// Cubes of 600 kg/m³, of 1 m and in stacks of 0.2 m. All that can be asked of them is known: where
// they rest, how heavy they are, that they stand still.

namespace {

constexpr double kSide = 1;

Part make_cube(std::size_t spheres) {
  return Part("cube", make_box(Eigen::Vector3d::Constant(kSide / 2)), spheres);
}
const Part& cube() {
  static const Part part = make_cube(4000);
  return part;
}

/// `load`: what the lowest cube bears, in cubes.
WorldSettings settings_of(const SceneOptions& options, double load) {
  WorldSettings settings = world_settings(options);
  settings.margin = 0.002 * kSide;
  settings.hulls = 1;
  settings.ist.patches = 4;  // as many as a face has corners
  // As deep as matched spheres blur a face: there it is in its place.
  set_law(settings, kWood * cube().volume(), kSide * kSide, 0.002 * kSide, 1, load);
  return settings;
}

double seconds_of(const SceneOptions& options, double own) {
  return options.seconds > 0 ? options.seconds : own;
}

/// A cube falls by 1 cm onto what is below it, and stands there as it came.
SceneResult come_to_rest(SceneWorld& world, btRigidBody& ground, btRigidBody& box, double height,
                         const SceneOptions& options) {
  Run run(world, options);
  const double seconds = seconds_of(options, 4);
  run.go(0.75 * seconds);
  const Eigen::Isometry3d before = world.mesh_frame(box);
  WeightOn weight(world, {&ground});
  run.go(0.25 * seconds, [&] { weight.look(); });
  const Eigen::Isometry3d after = world.mesh_frame(box);
  return run.finish(
      kSide,
      {{"force over weight", weight.along(), 0.99, 1.01},
       {"sideways force over weight", weight.across(), 0, 0.01},
       {"height off, of the side", (after.translation().z() - height) / kSide, -0.005, 0.005},
       {"tilt [rad]", angle_to_z(after), 0, 1e-3},
       {"creep, of the side a second",
        (after.translation() - before.translation()).norm() / (0.25 * seconds) / kSide, 0, 1e-4}});
}

}  // namespace

SceneResult run_box(const SceneOptions& options) {
  SceneWorld world(settings_of(options, 1));
  btRigidBody& ground = add_ground(world, kFriction);
  btRigidBody& box = world.add(
      cube(), kWood, place({0.1, 0.07, kSide / 2 + 0.01}, turn(0.3, {0, 0, 1})), kFriction);
  return come_to_rest(world, ground, box, kSide / 2, options);
}

SceneResult run_cube_on_cube(const SceneOptions& options) {
  SceneWorld world(settings_of(options, 1));
  btRigidBody& below = world.add(cube(), 0, place({0, 0, kSide / 2}), kFriction);
  btRigidBody& above =
      world.add(cube(), kWood, place({0, 0, 1.5 * kSide + 0.01}, turn(0.2, {0, 0, 1})), kFriction);
  return come_to_rest(world, below, above, 1.5 * kSide, options);
}

namespace {

/// Ten boxes of 0.2 m, each off its place by up to `aside` [u] and turned by up to `turned` [rad].
SceneResult stand(const SceneOptions& options, double aside, double turned) {
  constexpr int kCubes = 10;
  constexpr double kSmall = 0.2;
  static const Part box("box", make_box(Eigen::Vector3d::Constant(kSmall / 2)), 4000);
  WorldSettings settings = settings_of(options, kCubes);
  settings.margin = 0.002 * kSmall;
  settings.ist.patches = 8;
  if (options.way == Way::wrench) {
    set_law(settings, kWood * box.volume(), kSmall * kSmall, 0.002 * kSmall, 1, kCubes);
  }
  SceneWorld world(settings);
  btRigidBody& ground = add_ground(world, kFriction);
  std::mt19937 random(7);
  const auto draw = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  std::vector<btRigidBody*> boxes;
  std::vector<Eigen::Vector3d> begin;
  for (int i = 0; i < kCubes; ++i) {
    const double x = aside * draw(), y = aside * draw(), angle = turned * draw();
    begin.push_back({x, y, kSmall * (i + 0.5)});
    boxes.push_back(&world.add(box, kWood, place(begin.back(), turn(angle, {0, 0, 1})), kFriction));
  }
  Run run(world, options);
  const double seconds = seconds_of(options, options.full ? 60 : 8);
  run.go(0.75 * seconds);
  WeightOn weight(world, {&ground});
  run.go(0.25 * seconds, [&] { weight.look(); });
  double tilt = 0, moved = 0, sunk = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Eigen::Isometry3d at = world.mesh_frame(*boxes[i]);
    const Eigen::Vector3d off = (at.translation() - begin[i]) / kSmall;
    tilt = std::max(tilt, angle_to_z(at));
    moved = std::max(moved, off.head<2>().norm());
    sunk = std::max(sunk, std::abs(off.z()));
  }
  return run.finish(kSmall, {{"force over weight", weight.along(), 0.99, 1.01},
                             {"tilt [rad]", tilt, 0, 1e-3 * kCubes},
                             {"moved aside, of the side", moved, 0, aside > 0 ? 0.05 : 0.02},
                             {"height off, of the side, at worst", sunk, 0, 0.005 * kCubes}});
}

}  // namespace

SceneResult run_stack(const SceneOptions& options) { return stand(options, 0, 0); }
SceneResult run_askew(const SceneOptions& options) { return stand(options, 0.004, 0.06); }

SceneResult run_pile(const SceneOptions& options) {
  // Cubes that lie askew are asked of no height: fewer spheres do.
  const Part part = make_cube(1000);
  SceneWorld world(settings_of(options, 20));
  btRigidBody& ground = add_ground(world, kFriction);
  std::mt19937 random(5);
  const auto draw = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (int i = 0; i < 10; ++i) {
    const double angle = 6 * draw(), x = draw() - 0.5, y = draw() - 0.5, z = draw() - 0.5;
    const Eigen::Vector3d at(1.8 * (i % 2) + 0.3 * x, 1.8 * (i / 2 % 2) + 0.3 * y,
                             1 + 1.8 * (i / 4));
    world.add(part, kWood, place(at, turn(angle, {x, y, z + 0.01})), kFriction);
  }
  Run run(world, options);
  const double seconds = seconds_of(options, 8);
  run.go(0.8 * seconds);
  WeightOn weight(world, {&ground});
  double fastest = 0;
  run.go(0.2 * seconds, [&] {
    weight.look();
    fastest = std::max(fastest, world.kinetic_energy());
  });
  const double unit = total_mass(world) * kGravity * kSide;
  return run.finish(kSide, {{"force over weight", weight.along(), 0.99, 1.01},
                            {"kinetic energy, of weight times side", fastest / unit, 0, 1e-4}});
}
