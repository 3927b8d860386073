#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <ist/api.h>
#include <ist/query.h>
#include <ist/wrench.h>

// Contact laws: from a volume to a force, for loops and engines without a contact solver of their
// own. docs/engines.md explains which to choose.
//
// Units: [u] the meshes' length, [s] time, [force], and [mass] = [force·s²/u]. With u = m and force
// = N mass is kg; with u = mm and force = mN mass is kg too.
//
// A force of k · −translation_gradient is not a contact law (docs/engines.md, *What a volume
// provides*). Here the pressure grows with depth.

namespace IST_API ist {

/// Penalty pressure of each patch:
///
/// pressure [force/u²] = stiffness · depth · max(0, 1 + damping · d(depth)/dt), where the depth is
/// the patch's volume over a reference area. Never negative: nothing sticks.
struct ContactLaw {
  double stiffness = 0;  ///< [force/u³] > 0, penalty stiffness: pressure over depth (Winkler)
  /// [u²] Reference area. 0: the largest that each patch had (PatchMemory::area). This
  /// loses some energy where areas change: a ball that bounces on a plane keeps three quarters. A
  /// body then rests up to a quarter deeper than the depth passed to stiffness_for_depth().
  ///
  /// > 0: for a contact that is one patch (whole_patch). The law is then the gradient of ½
  /// stiffness · volume² / area, and conserves energy as the integrator does.
  double area = 0;
  /// [s/u] ≥ 0, Hunt and Crossley's: see damping_for_restitution(). It acts on the rate of the
  /// volume alone, so it does not brake a thread that slides along itself, and vanishes with the
  /// contact.
  double damping = 0;
  double friction = 0;            ///< ≥ 0, Coulomb's coefficient
  double friction_stiffness = 0;  ///< [force/u³] ≥ 0, of shear stress over stretch
  double friction_damping = 0;    ///< [force·s/u³] ≥ 0, of shear stress over velocity
};

/// State of a patch from step to step.
struct PatchMemory {
  std::uint64_t id = 0;  ///< ContactPatch::id
  /// [u²] The largest area of the patch since it appeared. Depth is measured with it, so the
  /// pressure is a function of the volume, and a growing area can only lose energy.
  double area = 0;
  double stretch[3] = {0, 0, 0};  ///< [u] of the friction spring, world
};

/// State of a contact of two bodies: plain data of the caller, one per pair. Copy it to save a
/// state. A default one is a new contact.
struct ContactMemory {
  static constexpr std::size_t kPatches = 32;
  PatchMemory patches[kPatches];
  std::uint32_t count = 0;  ///< of stored patches
};

/// Motion of B relative to A, in axes that do not turn with A: differences of world velocities.
struct RelativeMotion {
  /// [u/s] Velocity of B's origin minus that of the point of A at the same place.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s] B's minus A's
};

/// The relative motion of two bodies. `origin_b`: [u] of B's pose, world.
inline RelativeMotion relative_motion(const Twist& a, const Twist& b,
                                      const Eigen::Vector3d& origin_b) noexcept {
  const auto at_origin = [&](const Twist& t) -> Eigen::Vector3d {
    return t.velocity + t.angular_velocity.cross(origin_b - t.point);
  };
  return {at_origin(b) - at_origin(a), b.angular_velocity - a.angular_velocity};
}

/// Force and torque of a contact on B. A receives the opposite, about the same point.
struct ContactForce {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [force] on B, world
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< [force·u] on B about B's origin, world
  double normal_force = 0;  ///< [force] Σ over patches of pressure times area
  double energy = 0;        ///< [force·u] stored in the springs, of normal and friction
};

/// A penetration as one patch, for contacts that one force represents. Its id is 0, its point the
/// centroid, since B's origin is not known here.
inline ContactPatch whole_patch(const Penetration& contact) noexcept {
  ContactPatch patch;
  patch.centroid = patch.point = contact.centroid;
  patch.force = -contact.translation_gradient;
  patch.torque = -contact.rotation_gradient;
  patch.volume = contact.volume;
  patch.area = patch.force.norm();
  if (patch.area > 0) {
    patch.normal = patch.force / patch.area;
    patch.depth = patch.volume / patch.area;
  }
  return patch;
}

namespace detail {

/// A spring that holds the bodies together sideways up to Coulomb's limit and then slips.
///
/// With w the displacement of a step and s the stretch, either |f| is within the limit and f·w plus
/// the growth of ½ k s² is −½ k w², or s is the nearest point within the limit's ball and the sum
/// is less: no step gains energy.
inline Eigen::Vector3d friction_force(const ContactLaw& law, double limit,
                                      const Eigen::Vector3d& normal,
                                      const Eigen::Vector3d& velocity, double step,
                                      PatchMemory& memory) noexcept {
  const Eigen::Vector3d sliding = velocity - normal * normal.dot(velocity);
  const double stiffness = law.friction_stiffness * memory.area;
  Eigen::Map<Eigen::Vector3d> stretch(memory.stretch);
  stretch -= normal * normal.dot(stretch);
  stretch += step * sliding;
  const double held = stiffness * stretch.norm();
  if (held > limit) stretch *= limit / held;
  const Eigen::Vector3d spring = -stiffness * stretch;
  // The viscous part as far as the limit allows: the root of |spring + x drag| = limit.
  const Eigen::Vector3d drag = -law.friction_damping * memory.area * sliding;
  if ((spring + drag).squaredNorm() <= limit * limit) return spring + drag;
  const double a = drag.squaredNorm(), b = spring.dot(drag);
  const double c = std::max(0.0, limit * limit - spring.squaredNorm());
  const double share = a > 0 ? (std::sqrt(b * b + a * c) - b) / a : 0;
  return spring + std::clamp(share, 0.0, 1.0) * drag;
}

}  // namespace detail

/// Force of the contact on B in this step. Updates `memory`.
///
/// `origin_b`: [u] of B's pose, world. `step`: [s] since the last call, by which the friction
/// springs are stretched. `patches`: as contact_patches() wrote them. Patches beyond
/// ContactMemory::kPatches have no friction. Patches that are gone are forgotten.
///
/// The law gains no energy, except where the division into patches changes: see docs/engines.md.
///
/// No allocation, lock or exception. Any thread; a memory belongs to one contact.
inline ContactForce contact_force(const ContactLaw& law, std::span<const ContactPatch> patches,
                                  const RelativeMotion& motion, const Eigen::Vector3d& origin_b,
                                  double step, ContactMemory& memory) noexcept {
  ContactMemory next;
  ContactForce sum;
  for (const ContactPatch& patch : patches) {
    PatchMemory kept;
    kept.id = patch.id;
    for (std::uint32_t i = 0; i < memory.count; ++i) {
      if (memory.patches[i].id == patch.id) kept = memory.patches[i];
    }
    if (patch.area > kept.area) {
      // The friction springs grow with the area: their energy stays the same.
      const double share = std::sqrt(kept.area / patch.area);
      for (double& s : kept.stretch) s *= share;
      kept.area = patch.area;
    }
    if (!(kept.area > 0)) continue;

    const double rate = -(patch.force.dot(motion.velocity) +
                          patch.torque.dot(motion.angular_velocity));  // [u³/s] of the volume
    const double reference = law.area > 0 ? law.area : kept.area;
    const double pressure = law.stiffness * patch.volume / reference *
                            std::max(0.0, 1 + law.damping * rate / reference);
    const double normal_force = pressure * patch.area;
    sum.force += pressure * patch.force;
    sum.torque += pressure * patch.torque;
    sum.normal_force += normal_force;
    sum.energy += 0.5 * law.stiffness * patch.volume * patch.volume / reference;
    if (next.count == ContactMemory::kPatches) continue;
    if (law.friction > 0) {
      const Eigen::Vector3d arm = patch.centroid - origin_b;
      const Eigen::Vector3d force =
          detail::friction_force(law, law.friction * normal_force, patch.normal,
                                 motion.velocity + motion.angular_velocity.cross(arm), step, kept);
      sum.force += force;
      sum.torque += arm.cross(force);
      sum.energy += 0.5 * law.friction_stiffness * kept.area *
                    Eigen::Map<const Eigen::Vector3d>(kept.stretch).squaredNorm();
    }
    next.patches[next.count++] = kept;
  }
  memory = next;
  return sum;
}

/// [force/u³] Penalty stiffness at which a load [force] on an area [u²] rests at a depth [u]. Use
/// at least the depth of the spheres' blur, some 0.2 % of the side for 4,000 spheres.
inline double stiffness_for_depth(double load, double area, double depth) noexcept {
  return load / (area * depth);
}

/// [force/u³] Stiffness of an elastic layer on rigid ground that cannot expand sideways. `young`:
/// [force/u²] > 0. `poisson`: [0, 0.5). `thickness`: [u] > 0.
inline double stiffness_of_layer(double young, double poisson, double thickness) noexcept {
  return (1 - poisson) * young / ((1 + poisson) * (1 - 2 * poisson) * thickness);
}

/// [force/u³] Stiffness of two compliant bodies in contact.
inline double stiffness_in_series(double a, double b) noexcept { return a * b / (a + b); }

/// [s/u] ContactLaw::damping for which a body that hits at `speed` [u/s] > 0 rebounds at
/// `restitution` (0, 1] times that; exact for a patch of constant area. Slower bodies lose less.
inline double damping_for_restitution(double restitution, double speed) noexcept {
  // With x = damping · speed: m v dv/d(depth) = −k depth (1 + damping v) in both directions gives x
  // − ln(1 + x) = −e x − ln(1 − e x), for any power of depth. The left side minus the right side is
  // positive up to the root, then negative, without bound at 1/e.
  const auto excess = [e = restitution](double x) {
    return (1 + e) * x - std::log1p(x) + std::log1p(-e * x);
  };
  double low = 0, high = 1 / restitution;
  for (int i = 0; i < 60; ++i) {
    const double x = 0.5 * (low + high);
    (excess(x) > 0 ? low : high) = x;
  }
  return restitution < 1 ? low / speed : 0;
}

/// A body for effective_mass(). The default is immovable.
struct ContactBody {
  double inverse_mass = 0;                                    ///< [1/mass] ≥ 0
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  ///< [1/(mass·u²)] world, about
  Eigen::Vector3d centre_of_mass = Eigen::Vector3d::Zero();   ///< [u] world
};

/// [mass] Effective mass at `point` [u] along `direction` (unit), both world: the mass that would
/// respond to a force there as these two bodies do. Infinite if both are immovable.
inline double effective_mass(const ContactBody& a, const ContactBody& b,
                             const Eigen::Vector3d& point,
                             const Eigen::Vector3d& direction) noexcept {
  double inverse = 0;
  for (const ContactBody* body : {&a, &b}) {
    const Eigen::Vector3d moment = (point - body->centre_of_mass).cross(direction);
    inverse += body->inverse_mass + moment.dot(body->inverse_inertia * moment);
  }
  return inverse > 0 ? 1 / inverse : std::numeric_limits<double>::infinity();
}

/// [s] Above this step semi-implicit Euler (velocities first, then positions) gains energy from a
/// spring of `stiffness` [force/u] > 0 and a damper of `damping` [force·s/u] ≥ 0 that move `mass`.
/// For a contact, stiffness is ContactLaw::stiffness times its area, damping is
/// ContactLaw::stiffness · volume · ContactLaw::damping where it is deepest, and mass is
/// effective_mass(). Use a half of this or less.
inline double largest_stable_step(double stiffness, double damping, double mass) noexcept {
  const double frequency = std::sqrt(stiffness / mass);
  const double ratio = damping / (2 * mass * frequency);
  return 2 * (std::sqrt(ratio * ratio + 1) - ratio) / frequency;
}

/// [force/u] The stiffest undamped spring that is stable under semi-implicit Euler at this step
/// [s].
inline double largest_stable_stiffness(double step, double mass) noexcept {
  return 4 * mass / (step * step);
}

}  // namespace ist
