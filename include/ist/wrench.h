#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <ist/api.h>
#include <ist/query.h>

// Wrenches of a contact on both bodies, about points of the caller's choice, in the world frame.
// Nothing here allocates or throws; values of a stopped query carry its error.

namespace IST_API ist {

/// Force and moment on one body for a pressure of 1: −dV/d(its motion). Multiplied by a pressure
/// [force/u²] they are those of a penalty potential pressure · V.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [u²] points out of the other body
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< [u³] about the given point
};

/// The wrenches on both bodies.
struct Wrenches {
  Wrench on_a, on_b;  ///< equal and opposite: about the same point their sum is zero
};

/// A body's velocity.
struct Twist {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();             ///< [u] present position of a body
                                                               /// point
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [u/s] of that point
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// The same wrench about another point.
inline Wrench about(const Wrench& wrench, const Eigen::Vector3d& from,
                    const Eigen::Vector3d& to) noexcept {
  return {wrench.force, wrench.torque + (from - to).cross(wrench.force)};
}

/// Both wrenches from the one on B about B's origin, as queries return it.
inline Wrenches both_wrenches(const Wrench& on_b, const Eigen::Vector3d& origin_b,
                              const Eigen::Vector3d& point_a,
                              const Eigen::Vector3d& point_b) noexcept {
  return {about({-on_b.force, -on_b.torque}, origin_b, point_a), about(on_b, origin_b, point_b)};
}

/// Wrenches of a whole contact, on A about `point_a`, on B about `point_b` [u], usually the
/// centres of mass.
///
/// `b`: B's pose in the query.
inline Wrenches wrenches(const Penetration& contact, const Pose& b, const Eigen::Vector3d& point_a,
                         const Eigen::Vector3d& point_b) noexcept {
  return both_wrenches({-contact.translation_gradient, -contact.rotation_gradient},
                       Eigen::Vector3d(b.t), point_a, point_b);
}

/// Of one patch of a contact. Those of all patches sum to the whole contact's.
inline Wrenches wrenches(const ContactPatch& patch, const Pose& b, const Eigen::Vector3d& point_a,
                         const Eigen::Vector3d& point_b) noexcept {
  return both_wrenches({patch.force, patch.torque}, Eigen::Vector3d(b.t), point_a, point_b);
}

/// [u³/s] dV/dt while both bodies move: > 0 while the overlap grows.
///
/// For a patch, its share. A body at rest is a Twist().
template <class Contact>
double volume_rate(const Contact& contact, const Pose& b, const Twist& motion_a,
                   const Twist& motion_b) noexcept {
  const Wrenches push = wrenches(contact, b, motion_a.point, motion_b.point);
  return -(push.on_a.force.dot(motion_a.velocity) +
           push.on_a.torque.dot(motion_a.angular_velocity)) -
         (push.on_b.force.dot(motion_b.velocity) + push.on_b.torque.dot(motion_b.angular_velocity));
}

}  // namespace ist
