// Baked solids in DART's world, headless, each held against what physics says of it. Reads the
// assets of samples in FOLDER, writes NAME.csv there, a row for every tenth step, and scenes.json.
// Exits 1 if a truth does not hold.
#include <ist/bake.h>
#include <ist/error.h>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/PlaneShape.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "scene.h"

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using ist_dart::IstShape;
using std::numbers::pi;

Isometry3d at(const Vector3d& place, double angle = 0, const Vector3d& axis = Vector3d::UnitX()) {
  return Eigen::Translation3d(place) * Eigen::AngleAxisd(angle, axis);
}

/// The sample cube, 0.1 m wide, falls on an edge on DART's plane and comes to lie flat.
Scene box_on_plane(const ist::TreeView& cube) {
  const double half = 0.05;
  const auto solid = std::make_shared<IstShape>(cube, 2 * half);
  const auto ground = std::make_shared<dart::dynamics::PlaneShape>(Vector3d::UnitZ(), 0.0);
  Scene scene("box_on_plane", ground, solid, at({0, 0, 1.3 * half}, 0.2), 0.5);
  scene.run(3);
  scene.expect_rest(2, half);
  const Sample& last = scene.samples().back();
  scene.expect("height of the centre over half the side", last.position.z() / half, 0.995, 1.005);
  scene.expect("tilt [rad]", std::acos(std::min(1.0, last.rotation(2, 2))), 0, 1e-3);
  return scene;
}

/// The sample bolt, 21 mm long, falls on its side on DART's box a metre wide and comes to rest on
/// its head and thread.
Scene screw_on_table(const ist::TreeView& bolt) {
  const double scale = 1e-3, half_length = 10.5 * scale;
  const auto solid = std::make_shared<IstShape>(bolt, scale);
  const auto table = std::make_shared<dart::dynamics::BoxShape>(Vector3d(1, 1, 0.1));
  Scene scene("screw_on_table", table, solid, at({0, 0, 0.065}, 1.4), 0.5);
  scene.run(4);
  scene.expect_rest(3, half_length);
  // It lies on a side of its head, 7.5 mm off the axis and 16 from the tip, and on the thread's
  // last crest, 5 mm off the axis and at most a pitch of 2 mm from the tip.
  const double slope = std::tan(std::asin(std::abs(scene.samples().back().rotation(2, 2))));
  scene.expect("slope of the axis", slope, 2.5 / 16, 2.5 / 14);
  const auto group = scene.world()->getConstraintSolver()->getCollisionGroup();
  scene.expect("distance to the table [m]", group->distance(), 0, 1e-5);
  return scene;
}

/// A ball rolls to and fro at the bottom of a hollow one, both baked: without slip as a pendulum of
/// the length 7/5 (R − r).
Scene ball_in_bowl(const ist::TreeView& ball, const ist::TreeView& hollow) {
  const double scale = 0.1, inner = 0.9 * scale, radius = 0.02, swing = 0.5, arm = inner - radius;
  const Vector3d start(arm * std::sin(swing), 0, -arm * std::cos(swing));
  Scene scene("ball_in_bowl", std::make_shared<IstShape>(hollow, scale),
              std::make_shared<IstShape>(ball, radius), at(start), 1);
  scene.run(4);

  std::vector<double> crossings;  // of the middle, both ways
  for (std::size_t i = 1; i < scene.samples().size(); ++i) {
    const Sample &before = scene.samples()[i - 1], &after = scene.samples()[i];
    const double x0 = before.position.x(), x1 = after.position.x();
    if (x0 * x1 < 0) crossings.push_back(before.time + kTimeStep * x0 / (x0 - x1));
  }
  const double period =
      4 * std::comp_ellint_1(std::sin(swing / 2)) * std::sqrt(7 * arm / (5 * kGravity));
  scene.expect("swings", static_cast<double>(crossings.size()) / 2, 4 / period - 1, 4 / period + 1);
  if (crossings.size() < 3) return scene;
  const std::size_t halves = (crossings.size() - 1) & ~std::size_t{1};  // whole swings
  const double seconds = crossings[halves] - crossings[0];
  scene.expect("period over that of rolling without slip",
               2 * seconds / (static_cast<double>(halves) * period), 0.99, 1.01);
  // Over whole swings momentum comes back, so forces must average to the weight.
  Vector3d impulse = Vector3d::Zero();
  for (const Sample& one : scene.samples())
    if (one.time > crossings[0] && one.time <= crossings[halves]) impulse += one.force * kTimeStep;
  scene.expect("mean contact force over the weight", impulse.z() / (seconds * scene.weight()), 0.99,
               1.01);
  const double bottom = -scene.weight() * arm, lift = scene.weight() * arm * (1 - std::cos(swing));
  scene.expect("largest energy over that at the start",
               scene.largest(0, [&](const Sample& s) { return (s.energy - bottom) / lift; }), 0,
               1.01);
  // An impact without bounce at an edge of the mesh, some 0.05 rad sharp, takes 5/7 · 0.05² of the
  // kinetic energy, and some 250 are met.
  scene.expect("energy at the end over that at the start",
               (scene.samples().back().energy - bottom) / lift, std::exp(-250 * 5 / 7.0 * 0.0025),
               1.01);
  return scene;
}

/// The sample nut turns down the sample bolt by its weight, without friction: both are concave.
/// Energy gives the acceleration g / (1 + I (2π / pitch)² / m).
Scene nut_on_bolt(const ist::TreeView& nut, const ist::TreeView& bolt) {
  const double scale = 1e-3, pitch = 2 * scale;
  const auto solid = std::make_shared<IstShape>(nut, scale);
  Scene scene("nut_on_bolt", std::make_shared<IstShape>(bolt, scale), solid,
              at({0, 0, 11 * scale}, pi, Vector3d::UnitZ()), 0);
  const double turn_inertia = solid->computeInertia(1)(2, 2);
  const double acceleration = kGravity / (1 + turn_inertia * std::pow(2 * pi / pitch, 2));
  scene.run(1.6);

  const Sample* down = nullptr;  // the nut has fallen through the play and turned a quarter
  double turns = 0, off_axis = 0;
  const std::vector<Sample>& samples = scene.samples();
  std::size_t i = 0;
  for (; i + 1 < samples.size() && turns < 3.25; ++i) {
    const Eigen::Matrix3d step = samples[i + 1].rotation * samples[i].rotation.transpose();
    turns += std::atan2(step(0, 1) - step(1, 0), step(0, 0) + step(1, 1)) / (2 * pi);
    if (down == nullptr && turns >= 0.25) down = &samples[i + 1];
    off_axis = std::max(off_axis, samples[i + 1].position.head<2>().norm());
  }
  scene.expect("turns", turns, 3.25, 3.3);
  if (down == nullptr) return scene;
  const double way = down->position.z() - samples[i].position.z();
  scene.expect("way over pitch x turns", way / (pitch * (turns - 0.25)), 0.97, 1.03);
  scene.expect("off the axis, of the radial play", off_axis / (0.094 * scale), 0, 1);
  // What the solver takes: its impacts keep no energy. More than all would be made of nothing.
  const double ideal = acceleration * std::pow(samples[i].time, 2) / 2;
  scene.expect("way over that without any loss", (0.011 - samples[i].position.z()) / ideal, 0, 1);
  return scene;
}

void write_csv(const Scene& scene, const std::string& folder) {
  const std::string path = folder + "/" + scene.name() + ".csv";
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw ist::Error(path + ": cannot be written");
  std::fprintf(file,
               "time,x,y,z,axis_x,axis_y,axis_z,speed,spin,energy,force_x,force_y,force_z,"
               "contacts,depth\n");
  for (std::size_t i = 0; i < scene.samples().size(); i += 10) {
    const Sample& s = scene.samples()[i];
    const Vector3d& x = s.position;
    std::fprintf(
        file, "%.3f,%.9g,%.9g,%.9g,%.6g,%.6g,%.6g,%.6g,%.6g,%.9g,%.9g,%.9g,%.9g,%zu,%.6g\n", s.time,
        x.x(), x.y(), x.z(), s.rotation(0, 2), s.rotation(1, 2), s.rotation(2, 2), s.speed, s.spin,
        s.energy, s.force.x(), s.force.y(), s.force.z(), s.contacts, s.depth);
  }
  std::fclose(file);
}

/// Prints truths, and writes them as the value of a JSON member; true if all hold.
bool report(const std::string& name, const std::vector<Truth>& truths, std::FILE* json) {
  bool hold = true;
  std::printf("%s\n", name.c_str());
  std::fprintf(json, "  \"%s\": [", name.c_str());
  for (const Truth& truth : truths) {
    std::printf("  %-6s %-66s %12.6g  [%g, %g]\n", truth.holds() ? "ok" : "FAILED",
                truth.what.c_str(), truth.measured, truth.low, truth.high);
    std::fprintf(json,
                 "%s\n    {\"what\": \"%s\", \"measured\": %.9g, \"low\": %g, \"high\": %g, "
                 "\"holds\": %s}",
                 &truth == truths.data() ? "" : ",", truth.what.c_str(), truth.measured, truth.low,
                 truth.high, truth.holds() ? "true" : "false");
    hold &= truth.holds();
  }
  std::fprintf(json, "\n  ]");
  return hold;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return std::fprintf(stderr, "usage: scenes FOLDER\n"), 2;
  const std::string folder = argv[1];
  const auto load = [&](const char* name) {
    return ist::Asset::load(folder + "/" + name + ".ist");
  };
  const ist::Asset cube = load("cube"), bolt = load("bolt"), nut = load("nut"),
                   ball = load("sphere"), hollow = load("hollow_sphere");
  const std::string path = folder + "/scenes.json";
  std::FILE* json = std::fopen(path.c_str(), "w");
  if (json == nullptr) throw ist::Error(path + ": cannot be written");

  std::fprintf(json, "{\n");
  bool hold = true;
  hold &= report("interface", check_interface(cube.view()), json);
  const auto tell = [&](const Scene& scene) {
    write_csv(scene, folder);
    std::fprintf(json, ",\n");
    hold &= report(scene.name(), scene.truths(), json);
    std::printf("  %.0f steps a second\n", scene.steps_a_second());
  };
  tell(box_on_plane(cube.view()));
  tell(screw_on_table(bolt.view()));
  tell(nut_on_bolt(nut.view(), bolt.view()));
  tell(ball_in_bowl(ball.view(), hollow.view()));
  std::fprintf(json, "\n}\n");
  std::fclose(json);
  return hold ? 0 : 1;
} catch (const ist::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
