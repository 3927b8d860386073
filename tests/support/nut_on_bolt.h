#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ist/mesh.h>
#include <ist/query.h>

// A nut that gravity turns down a bolt, without friction: what a query's limits do to the energy of
// a loop. Both are the samples of their names, in mm, kg and s.

namespace ist::testing {

/// Mass, centre and inertia about it of a closed mesh's inside, at a density.
struct MassProperties {
  double mass = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};

inline MassProperties mass_properties(const TriangleMesh& mesh, double density) {
  double volume = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& triangle : mesh.triangles) {
    const auto corner = [&](std::size_t k) { return mesh.vertices[triangle[k]]; };
    const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2), sum = a + b + c;
    const double six = a.dot(b.cross(c));  // of the tetrahedron to the origin
    volume += six / 6;
    first += six / 24 * sum;
    second += six / 120 *
              (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  MassProperties result;
  result.mass = density * volume;
  result.centre = first / volume;
  second -= volume * result.centre * result.centre.transpose();
  result.inertia = density * (second.trace() * Eigen::Matrix3d::Identity() - second);
  return result;
}

/// A free body under gravity, stepped by symplectic Euler.
class FreeBody {
 public:
  FreeBody(const MassProperties& mass, const Eigen::Vector3d& origin,
           const Eigen::Quaterniond& turn)
      : mass_(mass), inverse_(mass.inertia.inverse()), turn_(turn) {
    place_ = origin + turn * mass.centre;
  }

  Eigen::Vector3d origin() const { return place_ - turn_ * mass_.centre; }
  const Eigen::Quaterniond& turn() const { return turn_; }
  Pose pose() const {
    const Eigen::Vector3d t = origin();
    return {{turn_.w(), turn_.x(), turn_.y(), turn_.z()}, {t.x(), t.y(), t.z()}};
  }

  /// `torque`: about the origin of the body.
  void step(const Eigen::Vector3d& force, const Eigen::Vector3d& torque, double gravity,
            double seconds) {
    momentum_ += seconds * (force - mass_.mass * gravity * Eigen::Vector3d::UnitZ());
    spin_ += seconds * (torque + (origin() - place_).cross(force));
    place_ += seconds / mass_.mass * momentum_;
    const Eigen::Vector3d way = seconds * velocity_of_turning();
    const double angle = way.norm();
    if (angle > 0) turn_ = Eigen::Quaterniond(Eigen::AngleAxisd(angle, way / angle)) * turn_;
    turn_.normalize();
  }

  double kinetic() const {
    return momentum_.squaredNorm() / (2 * mass_.mass) + spin_.dot(velocity_of_turning()) / 2;
  }
  double height() const { return place_.z(); }

  Eigen::Vector3d velocity_of_turning() const {
    return turn_ * (inverse_ * (turn_.conjugate() * spin_));
  }

 private:
  MassProperties mass_;
  Eigen::Matrix3d inverse_;
  Eigen::Vector3d place_;  ///< of the centre of mass
  Eigen::Quaterniond turn_;
  Eigen::Vector3d momentum_ = Eigen::Vector3d::Zero(), spin_ = Eigen::Vector3d::Zero();
};

/// The result of a run. Energies are in parts of what gravity set free.
struct NutRun {
  int ticks = 0;
  double travel = 0;  ///< [mm] down
  double turns = 0;
  double off_helix = 0;  ///< [mm] furthest from pitch × turns
  double grown = 0;      ///< most that the energy rose over its start
  double fell = 0;       ///< most that it sank below
  double stored = 0;     ///< largest contact energy
};

inline constexpr double kSteel = 7.85e-6;                            ///< [kg/mm³]
inline constexpr double kNutPitch = 2, kNutStart = 11, kNutEnd = 4;  ///< [mm]

/// Runs until the nut reaches the end of the thread or `seconds` are over. `ask(nut's pose)`
/// answers Penetration of the nut into the bolt, which rests at the origin.
template <class Ask>
NutRun run_nut(const MassProperties& nut, double stiffness, double rate, double seconds, Ask ask) {
  constexpr double kGravity = 9810;  // [mm/s²]
  constexpr double kLead = kNutPitch / (2 * std::numbers::pi);
  const Eigen::AngleAxisd fitting((kNutStart - 8) / kLead, Eigen::Vector3d::UnitZ());
  FreeBody body(nut, {0, 0, kNutStart}, Eigen::Quaterniond(fitting));
  const double start = body.height();
  NutRun run;
  double angle = 0, first = 0, most = 0, least = 0;
  const double tick = 1 / rate;
  // Kinetic energy belongs between two places: that of the step before goes with the new place's
  // potential by halves.
  double kinetic = 0;
  for (double time = 0; time < seconds && body.origin().z() > kNutEnd; time += tick, ++run.ticks) {
    const Penetration contact = ask(body.pose());
    const double before = kinetic;
    const Eigen::Vector3d spin = body.velocity_of_turning();
    const double stored = stiffness * contact.volume;
    const double lifted = nut.mass * kGravity * (body.height() - start);
    body.step(stiffness * contact.force, stiffness * contact.torque, kGravity, tick);
    kinetic = body.kinetic();
    const double energy = (before + kinetic) / 2 + lifted + stored;
    if (run.ticks == 0) first = energy;
    run.stored = std::max(run.stored, stored);
    most = std::max(most, energy - first);
    least = std::min(least, energy - first);
    angle += tick * (spin.z() + body.velocity_of_turning().z()) / 2;
    run.off_helix =
        std::max(run.off_helix, std::abs(body.origin().z() - kNutStart - angle * kLead));
    if (!std::isfinite(energy)) break;
  }
  run.travel = kNutStart - body.origin().z();
  run.turns = angle / (2 * std::numbers::pi);
  const double released = nut.mass * kGravity * std::max(run.travel, 1e-9);
  run.grown = most / released;
  run.fell = -least / released;
  return run;
}

}  // namespace ist::testing
