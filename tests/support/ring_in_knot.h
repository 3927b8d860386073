#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <ist/mesh.h>
#include <ist/pose_eigen.h>
#include <ist/query.h>

#include "mesh/samples/samples.h"
#include "support/nut_on_bolt.h"

// A ring around the tube of a fixed torus knot, drawn by a spring: it bounces along the tube
// without friction or damping. What a loop's limits do to energy shows here within seconds.

namespace ist::testing {

inline TriangleMesh ring_mesh() {
  TriangleMesh ring = make_sample("torus");
  for (Eigen::Vector3d& vertex : ring.vertices) vertex *= 0.6;
  return ring;
}

/// Energies over that of the start, at ticks without contact.
struct RingRun {
  double grown = 0;  ///< most that it rose
  double fell = 0;   ///< most that it sank
  int touching = 0, apart = 0;
};

/// `ask(pose of the ring)` answers Penetration of the ring (B) with the knot, which rests at the
/// origin. Its potential is ½ · stiffness · volume².
template <class Ask>
RingRun run_ring(double stiffness, double rate, double seconds, Ask ask) {
  const double spring = 10;
  const Eigen::Vector3d start(3, 0, 0), anchor(-2.5, 0.4, 0.7);
  MassProperties ring = mass_properties(ring_mesh(), 1);
  ring.inertia /= ring.mass;
  ring.mass = 1;
  FreeBody body(
      ring, start,
      Eigen::Quaterniond(Eigen::AngleAxisd(-std::atan2(2.0, -1.0), Eigen::Vector3d::UnitX())));
  RingRun run;
  double kinetic = 0, first = 0;
  for (int tick = 0; tick < seconds * rate; ++tick) {
    const Penetration contact = ask(body.pose());
    const Eigen::Vector3d stretch = body.origin() - anchor;
    const double stored =
        stiffness / 2 * contact.volume * contact.volume + spring / 2 * stretch.squaredNorm();
    const double pressure = stiffness * contact.volume;
    const double before = kinetic;
    body.step(pressure * contact.force - spring * stretch, pressure * contact.torque, 0, 1 / rate);
    kinetic = body.kinetic();
    if (contact.volume > 0) {
      ++run.touching;
      continue;
    }
    ++run.apart;
    const double energy = (before + kinetic) / 2 + stored;
    if (first == 0) first = energy;
    if (!std::isfinite(energy)) return {energy, energy, run.touching, run.apart};
    run.grown = std::max(run.grown, energy / first - 1);
    run.fell = std::max(run.fell, 1 - energy / first);
  }
  return run;
}

}  // namespace ist::testing
