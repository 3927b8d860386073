#include <ist/mesh.h>

#include <random>

#include "meshes.h"
#include "scene_tools.h"

// Parts that fall into, onto and through one another and come to rest. mm, kg, s, but for the
// bunnies.

namespace {

WorldSettings settings_of_parts(const SceneOptions& options) {
  WorldSettings settings = world_settings(options, kGravityOfMillimetres);
  settings.margin = 0.05;
  return settings;
}

}  // namespace

SceneResult run_screw(const SceneOptions& options) {
  constexpr double kSteel = 7.85e-6, kTop = 700;
  const Part screw("screw", ist::load_mesh((options.meshes / "bolt.obj").string()), 2000);
  // A top of 2.1 m, 25 mm thick, on four legs.
  const Part table("table",
                   make_cells({-1050, -1000, -940, 940, 1000, 1050},
                              {-600, -560, -500, 500, 560, 600}, {0, kTop - 25, kTop},
                              [](int i, int j, int k) {
                                return k == 1 || ((i == 1 || i == 3) && (j == 1 || j == 3));
                              }),
                   4000);
  const double mass = kSteel * screw.volume();
  WorldSettings settings = settings_of_parts(options);
  set_law(settings, mass, 10, 0.02, 500);
  SceneWorld world(settings);
  btRigidBody& t = world.add(table, 0, place({0, 0, 0}), 0.4);
  btRigidBody& s =
      world.add(screw, kSteel, place({310, 170, kTop + 25}, turn(1.2, {1, 0.3, 0.2})), 0.4);
  // A screw rolls on its head's corners for long: air and wood take some of it.
  s.setDamping(0.05, 0.3);
  Run run(world, options);
  const double seconds = options.seconds > 0 ? options.seconds : 3;
  run.go(0.8 * seconds);
  WeightOn weight(world, {&t});
  run.go(0.2 * seconds, [&] { weight.look(); });
  // It lies on a side of its head: half the width across flats, or less where it leans.
  const double height = to_eigen(s.getCenterOfMassPosition()).z() - kTop;
  std::vector<Truth> truths = {{"force over weight", weight.along(), 0.99, 1.01},
                               {"height of its centre over the table [mm]", height, 4, 11}};
  SceneResult result = run.finish(21, std::move(truths));
  result.truths.push_back({"kinetic energy, of weight times length",
                           result.kinetic_energy / (mass * kGravityOfMillimetres * 21), 0, 1e-4});
  return result;
}

SceneResult run_drop(const SceneOptions& options) {
  constexpr double kSteel = 7.85e-6, kPlate = 2, kFall = 200;
  const Part screw("screw", ist::load_mesh((options.meshes / "bolt.obj").string()), 2000);
  const Part plate("plate", make_box({150, 150, kPlate / 2}), 4000);
  const double mass = kSteel * screw.volume();
  WorldSettings settings = settings_of_parts(options);
  set_law(settings, mass, 10, 0.02, 500);
  SceneWorld world(settings);
  btRigidBody& p = world.add(plate, 0, place({0, 0, -kPlate / 2}), 0.4);
  std::vector<btRigidBody*> screws;
  for (int i = 0; i < 8; ++i) {
    screws.push_back(&world.add(
        screw, kSteel,
        place({60.0 * (i % 4) - 90, 60.0 * (i / 4) - 30, kFall}, turn(0.8 * i, {1, 0.3 * i, 0.2})),
        0.4));
    screws.back()->setDamping(0.05, 0.3);
    screws.back()->setCcdMotionThreshold(kPlate / 2);
  }
  Run run(world, options);
  const double seconds = options.seconds > 0 ? options.seconds : 3;
  run.go(0.8 * seconds);
  WeightOn weight(world, {&p});
  run.go(0.2 * seconds, [&] { weight.look(); });
  int above = 0;
  for (const btRigidBody* s : screws) above += s->getCenterOfMassPosition().z() > 0;
  SceneResult result = run.finish(21, {{"screws on the plate", static_cast<double>(above), 8, 8},
                                       {"force over weight", weight.along(), 0.99, 1.01}});
  result.truths.push_back({"kinetic energy, of weight times length",
                           result.kinetic_energy / (8 * mass * kGravityOfMillimetres * 21), 0,
                           1e-4});
  return result;
}

SceneResult run_bowl(const SceneOptions& options) {
  constexpr double kDensity = 1e-6, kBall = 30, kFoot = 30, kOuter = 100, kWall = 8;
  std::vector<std::pair<double, double>> profile = {{0, 0}, {kFoot, 0}};
  const double low = kOuter - std::sqrt(kOuter * kOuter - kFoot * kFoot);  // where foot meets ball
  const auto arc = [&](double radius, double from, double to) {
    for (int i = 0; i <= 12; ++i) {
      const double z = from + (to - from) * i / 12;
      const double r = std::sqrt(std::max(0.0, radius * radius - (kOuter - z) * (kOuter - z)));
      profile.emplace_back(i == 12 && to == kWall ? 0 : r, z - low);
    }
  };
  arc(kOuter, low + 1, 75);
  arc(kOuter - kWall, 75, kWall);
  const Part bowl("bowl", make_turned(profile, 64), 4000);
  const Part ball("ball", make_ball(kBall, 48), 1000);
  const Part box("box",
                 make_cells({-130, -120, 120, 130}, {-130, -120, 120, 130}, {0, 10, 90},
                            [](int i, int j, int k) { return k == 0 || i != 1 || j != 1; }),
                 4000);
  WorldSettings settings = settings_of_parts(options);
  set_law(settings, kDensity * ball.volume(), 200, 0.1, 500);
  SceneWorld world(settings);
  btRigidBody& ground = add_ground(world, 0.5);
  world.add(box, kDensity, place({0, 0, 1}), 0.5);
  btRigidBody& bowl_body = world.add(bowl, kDensity, place({5, 3, 12}), 0.5);
  btRigidBody& ball_body = world.add(ball, kDensity, place({20, 3, 60}), 0.5);
  ball_body.setDamping(0.1, 0.9);  // a ball rolls for long: felt takes some of it
  Run run(world, options);
  const double seconds = options.seconds > 0 ? options.seconds : 4;
  run.go(0.8 * seconds);
  WeightOn weight(world, {&ground});
  run.go(0.2 * seconds, [&] { weight.look(); });
  const Eigen::Isometry3d in_bowl =
      world.mesh_frame(bowl_body).inverse() * world.mesh_frame(ball_body);
  const Eigen::Vector3d centre = in_bowl.translation();
  SceneResult result =
      run.finish(2 * kBall, {{"force over weight", weight.along(), 0.99, 1.01},
                             {"ball off the bowl's axis [mm]", centre.head<2>().norm(), 0, 3},
                             {"ball's height off, of its diameter",
                              (centre.z() - (kWall - low) - kBall) / (2 * kBall), -0.01, 0.01}});
  result.truths.push_back(
      {"kinetic energy, of weight times ball",
       result.kinetic_energy / (total_mass(world) * kGravityOfMillimetres * 2 * kBall), 0, 1e-4});
  return result;
}

SceneResult run_peg(const SceneOptions& options) {
  constexpr double kSteel = 7.85e-6, kPeg = 8, kHole = 8.1, kDeep = 40, kLong = 50;
  const Part peg(
      "peg", make_turned({{0, 0}, {kPeg - 1, 0}, {kPeg, 1}, {kPeg, kLong}, {0, kLong}}, 96), 4000);
  const Part block(
      "block",
      make_turned({{kHole, 0}, {30, 0}, {30, kDeep}, {kHole + 2, kDeep}, {kHole, kDeep - 2}}, 96),
      4000);
  const double mass = kSteel * peg.volume();
  WorldSettings settings = settings_of_parts(options);
  settings.hulls = 24;
  settings.margin = 0.02;
  settings.ist.patches = 16;
  // The fit leaves less than bodies of this size sink in by default.
  settings.ist.law.stiffness = ist::stiffness_for_depth(mass * kGravityOfMillimetres, 100, 0.02);
  set_law(settings, mass, 100, 0.02, 100);
  SceneWorld world(settings);
  add_ground(world, 0.1);
  world.add(block, 0, place({0, 0, 0}), 0.1);
  btRigidBody& p = world.add(peg, kSteel, place({0.6, 0.2, kDeep + 1}, turn(0.02, {1, 2, 0})), 0.1);
  Run run(world, options);
  double aside = 0;  // while at least half of the hole holds it
  run.go(options.seconds > 0 ? options.seconds : 1.5, [&] {
    const Eigen::Vector3d foot = world.mesh_frame(p).translation();
    if (foot.z() < kDeep / 2) aside = std::max(aside, foot.head<2>().norm());
  });
  const Eigen::Isometry3d at = world.mesh_frame(p);
  // The chamfer makes the peg rock: its foot meets the wall at v = 0.1 m/s. It presses a strip of
  // some 60 mm², half as deep in the mean as at the foot, with a quarter of the peg's mass, so its
  // spring has ω² = 0.6 · 4 / 2 · g / 0.02 mm. Undamped that stops it after v / ω = 0.13 mm, 2.3
  // clearances off the axis. Matched spheres held it within 1.5, since they stick out of the walls.
  return run.finish(2 * kPeg,
                    {{"height of its foot [mm]", at.translation().z(), -0.1, 0.1},
                     {"tilt [rad], of what the clearance leaves",
                      angle_to_z(at) / (2 * (kHole - kPeg) / kDeep), 0, 1},
                     {"farthest off the axis, of the clearance", aside / (kHole - kPeg), 0, 2}});
}

SceneResult run_bunnies(const SceneOptions& options) {
  // Metres. 30 toys of a hand's size, as heavy as wood.
  constexpr double kDensity = 600, kMetres = 9.81, kSize = 0.15;
  const std::filesystem::path file = options.shared / "meshes/dev/bunny_60k.ply";
  const bool real = !options.shared.empty() && std::filesystem::exists(file);
  ist::TriangleMesh mesh =
      ist::load_mesh(real ? file.string() : (options.meshes / "torus_knot.obj").string());
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& v : mesh.vertices) bounds.extend(v);
  const double scale = kSize / bounds.sizes().maxCoeff();
  for (Eigen::Vector3d& v : mesh.vertices) v = scale * (v - bounds.center());
  const Part bunny("bunny", std::move(mesh), 1000);
  const double mass = kDensity * bunny.volume();

  WorldSettings settings = settings_of_parts(options);
  settings.gravity = {0, 0, -kMetres};
  settings.margin = 0.001;
  set_law(settings, mass, 0.0005, 0.0005, 1);
  SceneWorld world(settings);
  constexpr double kHalf = 0.25, kWall = 0.05, kHigh = 0.6;
  std::vector<const btRigidBody*> walls;
  const auto wall = [&](const Eigen::Vector3d& half, const Eigen::Vector3d& at) {
    walls.push_back(
        &world.add_still(std::make_unique<btBoxShape>(to_bullet(half)), place(at), 0.5));
  };
  wall({kHalf + 2 * kWall, kHalf + 2 * kWall, kWall}, {0, 0, -kWall});
  for (const double side : {-1.0, 1.0}) {
    wall({kWall, kHalf + 2 * kWall, kHigh}, {side * (kHalf + kWall), 0, kHigh});
    wall({kHalf, kWall, kHigh}, {0, side * (kHalf + kWall), kHigh});
  }
  std::mt19937 random(1);
  const auto draw = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  for (int i = 0; i < 30; ++i) {
    const double a = 6 * draw(), x = draw(), y = draw(), z = draw();
    world.add(bunny, kDensity,
              place({0.16 * (i % 3 - 1) + 0.01 * x, 0.16 * (i / 3 % 3 - 1) + 0.01 * y,
                     0.12 + 0.18 * (i / 9)},
                    turn(a, {x, y, z + 0.01})),
              0.5);
  }
  Run run(world, options);
  const double seconds = options.seconds > 0 ? options.seconds : 4;
  run.go(0.8 * seconds);
  WeightOn weight(world, walls);
  run.go(0.2 * seconds, [&] { weight.look(); });
  int inside = 0;
  for (const SceneWorld::Body& body : world.bodies()) {
    if (body.rigid->getInvMass() == 0) continue;
    const Eigen::Vector3d at = to_eigen(body.rigid->getCenterOfMassPosition());
    inside += std::abs(at.x()) < kHalf && std::abs(at.y()) < kHalf && at.z() > 0;
  }
  SceneResult result =
      run.finish(kSize, {{"bunnies in the crate", static_cast<double>(inside), 30, 30},
                         {"force over weight", weight.along(), 0.99, 1.01}});
  result.truths.push_back({"kinetic energy, of weight times size",
                           result.kinetic_energy / (total_mass(world) * kMetres * kSize), 0, 1e-4});
  return result;
}
