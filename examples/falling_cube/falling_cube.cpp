// A rigid body without an engine: a cube of side 1 falls on the floor, tilted, and comes to rest.
// Mass from the asset, contact law from <ist/contact_law.h>, path as a Motion. Exits with 1 if the
// result is unphysical: ist bake cube.obj -o cube.ist --spheres 1000; falling_cube cube.ist
#include <ist/bake.h>
#include <ist/contact_law.h>
#include <ist/mass_properties.h>
#include <ist/query.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>
#include <ist/types.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>

using Eigen::Vector3d;

constexpr double kStep = 1.0 / 480;  // [s]
constexpr double kGravity = 9.81;    // [u/s²]
constexpr double kHeight = 2;        // [u] of the centre at the start
constexpr double kDepth = 0.005;     // [u] how deep the cube is to rest
constexpr int kSteps = 10 * 480;

int main(int argc, char** argv) try {
  if (argc != 2) return std::fprintf(stderr, "usage: falling_cube CUBE.ist\n"), 2;
  const ist::Asset asset = ist::Asset::load(argv[1]);
  const ist::PlacedShape floor{ist::HalfSpaceShape{Vector3d::UnitZ(), 0}, {}};  // z ≤ 0
  ist::Workspace scratch;
  ist::ContactMemory memory;

  // The asset says what a solid of density 1 weighs, and where its centre of mass is.
  const ist::MassProperties own = ist::mass_properties(asset.view());
  const double mass = own.volume, weight = mass * kGravity;
  const double tilt = 0.3;  // [rad] about x
  ist::PlacedAsset cube{asset.view(), {{std::cos(tilt / 2), std::sin(tilt / 2), 0, 0}, {}}};
  cube.pose.t[2] = kHeight - ist::mass_properties(cube).centre_of_mass.z();
  const double lowest = ist::bounds(cube).lower.z();  // the edge that touches first

  ist::ContactLaw law;
  law.stiffness = ist::stiffness_for_depth(weight, 1, kDepth);  // on a face of 1 u²
  law.damping = ist::damping_for_restitution(0.1, std::sqrt(2 * kGravity * kHeight));
  law.friction = 0.5;
  law.friction_stiffness = law.stiffness / 4;
  law.friction_damping = 0.2 * law.friction_stiffness / std::sqrt(law.stiffness / mass);
  if (kStep > ist::largest_stable_step(law.stiffness, 0, mass) / 2) return 1;

  Vector3d velocity = Vector3d::Zero(), spin = Vector3d::Zero();  // [u/s], momentum [mass u²/s]
  double touched = -1, pushed = 0;  // [s]; [force] mean over the last second
  for (int step = 0; step < kSteps; ++step) {
    const double time = step * kStep;
    const ist::MassProperties now = ist::mass_properties(cube);  // in the world
    const Eigen::Matrix3d inverse_inertia = now.inertia.inverse();
    Vector3d force(0, 0, -weight), torque = Vector3d::Zero();

    // A certain no costs a fraction of the patches.
    if (ist::overlap(floor, cube, scratch) == ist::YesNo::no) {
      memory = {};
    } else {
      std::array<ist::ContactPatch, 16> patches;
      const ist::ContactPatches found = ist::contact_patches(floor, cube, {}, scratch, patches);
      const ist::Motion falls{velocity, inverse_inertia * spin, own.centre_of_mass};
      const Vector3d origin(cube.pose.t);
      const ist::ContactForce push =
          ist::contact_force(law, std::span(patches).first(found.count),
                             ist::relative_motion(floor, cube, {}, falls), origin, kStep, memory);
      // The law's torque is about the cube's origin; a free body turns about its centre of mass.
      const ist::Wrench on_cube = ist::about({push.force, push.torque}, origin, now.centre_of_mass);
      force += on_cube.force;
      torque += on_cube.torque;
      if (step >= kSteps - 480) pushed += push.force.z() / 480;
    }
    if (step % 240 == 0)
      std::printf("%5.2f s  height %8.5f  speed %8.5f\n", time, now.centre_of_mass.z(),
                  velocity.norm());

    // Velocities first, then places: symplectic Euler.
    velocity += kStep / mass * force;
    spin += kStep * torque;
    const ist::Motion motion{velocity, inverse_inertia * spin, own.centre_of_mass};
    if (touched < 0) {
      const ist::TimeOfImpact impact =
          ist::time_of_impact(floor, cube, {{}, motion}, {.duration = kStep}, scratch);
      if (impact.kind != ist::ImpactKind::no_impact) {
        touched = time + impact.time;
        std::printf("%7.4f s  touches, no more than %.2g above the floor\n", touched,
                    impact.distance_max);
      }
    }
    cube.pose = ist::moved(cube.pose, motion, kStep);
  }

  const double falls = std::sqrt(2 * lowest / kGravity);
  const ist::Bounds box = ist::bounds(cube);
  const double leans = box.upper.z() - box.lower.z() - 1;  // [rad] on an edge
  const double rests = ist::mass_properties(cube).centre_of_mass.z();
  std::printf("touches at %.4f s: free fall takes %.4f\n", touched, falls);
  std::printf("rests at %.4f, leans by %.0e: half its side less what a face gives is %.4f\n", rests,
              leans, 0.5 - kDepth);
  std::printf("is pushed by %.4f: its weight is %.4f\n", pushed, weight);
  const bool holds = std::abs(touched - falls) < kStep &&
                     std::abs(rests - 0.5 + kDepth) < kDepth / 2 && leans < 2e-3 &&
                     velocity.squaredNorm() < 1e-6 * 2 * kGravity * lowest &&
                     std::abs(pushed - weight) < 1e-3 * weight;
  std::puts(holds ? "as physics has it" : "not as physics has it");
  return holds ? 0 : 1;
} catch (const ist::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
