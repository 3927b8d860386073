#pragma once

#include <ist/contact_law.h>
#include <ist/mass_properties.h>
#include <ist/query.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "hand.h"

/// A vector that turns `from` into `to`: axis times angle, at most π.
inline Eigen::Vector3d turn_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  Eigen::Quaterniond q = to * from.conjugate();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  return sine > 0 ? Eigen::Vector3d(2 * std::atan2(sine, q.w()) / sine * q.vec())
                  : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

/// What the device feels, and where the energy is. Its unit: the probe has mass 1, lengths are the
/// assets', time is in seconds.
struct Felt {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< on the hand
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< on the hand, about the probe's origin
  double from_hand = 0;                              ///< work of the hand in all
  double stored = 0;                                 ///< in the springs and in what moves
};

/// The body that stands for the probe in the simulation, held to the device by a spring and a
/// damper in translation and in rotation (virtual coupling), pushed by the object: symplectic
/// Euler.
class Proxy {
 public:
  /// `coupling_hz`, `contact_hz`: frequency of a mass 1 on either spring.
  Proxy(const ist::PlacedAsset& probe, double coupling_hz, double contact_hz) {
    const ist::MassProperties mass =
        ist::mass_properties(ist::PlacedAsset{probe.asset, {}, probe.scale});
    centre_ = mass.centre_of_mass;
    inertia_ = mass.inertia / mass.volume;
    inverse_ = inertia_.inverse();
    const double omega = 2 * std::numbers::pi * coupling_hz;
    stiffness_ = omega * omega;
    damping_ = 2 * kRatio * omega;
    // Of turning likewise, about the centre of mass and the axis that turns most easily.
    turning_ = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia_).eigenvalues().x();
    const double contact = 2 * std::numbers::pi * contact_hz;
    law_.area = kAreaShare * std::cbrt(mass.volume) * std::cbrt(mass.volume);
    law_.stiffness = contact * contact / law_.area;
  }

  double stiffness() const { return stiffness_; }
  double turning_stiffness() const { return turning_ * stiffness_; }

  void place(const HandPose& hand) {
    turn_ = hand.turn;
    place_ = hand.place + turn_ * centre_;
    velocity_.setZero();
    spin_.setZero();
  }
  HandPose pose() const { return {place_ - turn_ * centre_, turn_}; }

  /// From the hand's pose at this tick, and that at the next one, to which the hand moves
  /// meanwhile.
  Felt step(const HandPose& hand, const HandPose& next, const ist::Penetration& contact,
            double seconds) {
    const Eigen::Vector3d held = hand.place + hand.turn * centre_;
    const Eigen::Vector3d way = next.place + next.turn * centre_ - held;
    const Eigen::Vector3d turning = turn_between(hand.turn, next.turn);
    const Eigen::Vector3d stretch = held - place_, twist = turn_between(turn_, hand.turn);
    const Eigen::Vector3d omega = angular_velocity();
    const Eigen::Vector3d pull = stiffness_ * stretch + damping_ * (way / seconds - velocity_);
    const Eigen::Vector3d moment =
        turning_ * (stiffness_ * twist + damping_ * (turning / seconds - omega));

    const HandPose own = pose();
    ist::Motion motion;  // about the origin
    motion.velocity = velocity_ - omega.cross(turn_ * centre_);
    motion.angular_velocity = omega;
    const ist::ContactPatch patch = ist::whole_patch(contact);
    const ist::ContactForce push =
        ist::contact_force(law_, {&patch, 1}, motion, own.place, seconds, memory_);

    const double before = kinetic();
    velocity_ += seconds * (pull + push.force);
    spin_ += seconds * (moment + push.torque - (turn_ * centre_).cross(push.force));
    place_ += seconds * velocity_;
    const Eigen::Vector3d turned = seconds * angular_velocity();
    const double angle = turned.norm();
    if (angle > 0) turn_ = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turned / angle)) * turn_;
    turn_.normalize();

    Felt felt;
    felt.force = -pull;
    felt.torque = -moment - (hand.turn * centre_).cross(pull);
    felt.from_hand = work_;
    felt.stored = 0.5 * stiffness_ * (stretch.squaredNorm() + turning_ * twist.squaredNorm()) +
                  push.energy + (before + kinetic()) / 2;
    work_ += pull.dot(way) + moment.dot(turning);
    return felt;
  }

 private:
  static constexpr double kRatio = 0.7;      ///< of critical damping
  static constexpr double kAreaShare = 0.5;  ///< contact's area of reference, of volume^⅔

  Eigen::Vector3d angular_velocity() const {
    return turn_ * (inverse_ * (turn_.conjugate() * spin_));
  }
  double kinetic() const { return (velocity_.squaredNorm() + spin_.dot(angular_velocity())) / 2; }

  Eigen::Vector3d centre_;
  Eigen::Matrix3d inertia_, inverse_;
  double stiffness_, damping_, turning_;
  ist::ContactLaw law_;
  ist::ContactMemory memory_;
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();  ///< of the centre of mass
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero(), spin_ = Eigen::Vector3d::Zero();
  double work_ = 0;
};

/// Passivity: the energy that the hand put in minus the stored energy must not be negative.
struct Passivity {
  double deficit = 0;  ///< the most that it fell below
  double peak = 0;     ///< the most that was stored
  double first = 0;
  bool begun = false;

  void count(const Felt& felt) {
    if (!begun) first = felt.stored;
    begun = true;
    peak = std::max(peak, felt.stored);
    const double balance = felt.from_hand - (felt.stored - first);
    deficit = std::isfinite(balance) ? std::max(deficit, -balance) : INFINITY;
  }
  /// The bound: a hundredth of the largest energy stored.
  bool kept() const { return std::isfinite(deficit) && deficit <= kBound * peak; }
  static constexpr double kBound = 0.01;
};
