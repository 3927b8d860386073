#pragma once

#include <ist/bullet/convert.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "scene.h"

using ist::bullet::to_bullet;
using ist::bullet::to_eigen;

// What scenes have in common: places, laws, and what bodies at rest must obey.

inline Eigen::Isometry3d place(const Eigen::Vector3d& t,
                               const Eigen::Quaterniond& q = Eigen::Quaterniond::Identity()) {
  Eigen::Isometry3d x = Eigen::Isometry3d::Identity();
  x.linear() = q.toRotationMatrix();
  x.translation() = t;
  return x;
}
inline Eigen::Quaterniond turn(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

/// The solver's springs are the adapter's own. For the wrench sets the law so that `load` bodies of
/// `mass` rest on `area` [u²] of the lowest at `depth` [u], or as near to it as the step bears,
/// where bodies meet at up to `speed` [u/s].
///
/// A body that touches on several sides is held by several springs, at arms that make it lighter:
/// with a quarter of the largest stable frequency some ten of them are still stable.
inline void set_law(WorldSettings& settings, double mass, double area, double depth, double speed,
                    double load = 1) {
  if (settings.way != Way::wrench) return;
  constexpr double kShare = 0.25;
  ist::ContactLaw& law = settings.ist.law;
  law.stiffness =
      std::min(ist::stiffness_for_depth(load * mass * settings.gravity.norm(), area, depth),
               kShare * kShare * ist::largest_stable_stiffness(settings.step, mass) / area);
  const double frequency = std::sqrt(law.stiffness * area / mass);
  law.damping = ist::damping_for_restitution(0.3, speed);
  law.friction_stiffness = 0.25 * law.stiffness;
  law.friction_damping = 0.2 * law.friction_stiffness / frequency;
}

/// The plane z = 0, held still.
inline btRigidBody& add_ground(SceneWorld& world, double friction) {
  return world.add_still(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), 0),
                         Eigen::Isometry3d::Identity(), friction);
}

/// Mean of what contacts push still bodies with along gravity over the samples, over the weight of
/// all that moves: 1 at rest.
class WeightOn {
 public:
  WeightOn(const SceneWorld& world, std::vector<const btRigidBody*> grounds)
      : world_(world), grounds_(std::move(grounds)) {}

  void look() {
    double mass = 0;
    for (const SceneWorld::Body& body : world_.bodies()) {
      if (body.rigid->getInvMass() > 0) mass += 1 / body.rigid->getInvMass();
    }
    const Eigen::Vector3d& g = world_.settings().gravity;
    for (const btRigidBody* ground : grounds_) {
      sum_ += world_.contact_force(*ground) / (mass * g.norm());
    }
    ++count_;
  }
  double along() const {
    return sum_.dot(world_.settings().gravity.normalized()) / std::max(1, count_);
  }
  double across() const {
    const Eigen::Vector3d down = world_.settings().gravity.normalized();
    return (sum_ - down * down.dot(sum_)).norm() / std::max(1, count_);
  }

 private:
  const SceneWorld& world_;
  std::vector<const btRigidBody*> grounds_;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

inline double angle_to_z(const Eigen::Isometry3d& x) {
  return std::acos(std::clamp(std::abs(x.linear()(2, 2)), 0.0, 1.0));
}

inline double total_mass(const SceneWorld& world) {
  double mass = 0;
  for (const SceneWorld::Body& body : world.bodies()) {
    if (body.rigid->getInvMass() > 0) mass += 1 / body.rigid->getInvMass();
  }
  return mass;
}

constexpr double kNone = 1e300;  // no bound on this side
