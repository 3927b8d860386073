#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <variant>

#include <ist/query.h>
#include <ist/types.h>

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
  return both_wrenches({contact.force, contact.torque}, Eigen::Vector3d(b.t), point_a, point_b);
}

/// The wrenches of one patch of a contact. Those of all patches sum to the whole contact's.
inline Wrenches wrenches(const ContactPatch& patch, const Pose& b, const Eigen::Vector3d& point_a,
                         const Eigen::Vector3d& point_b) noexcept {
  return both_wrenches({patch.force, patch.torque}, Eigen::Vector3d(b.t), point_a, point_b);
}

/// [u] Where a point of a solid's own frame is in the world.
inline Eigen::Vector3d world_point(const PlacedSolid& solid, const Eigen::Vector3d& own) noexcept {
  return std::visit(
      [&](const auto& placed) -> Eigen::Vector3d {
        const auto& [q, t] = placed.pose;
        return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized() * (placed.scale * own) +
               Eigen::Vector3d(t);
      },
      solid.placed);
}

/// [u³/T] dV/dt while both solids of a query move: > 0 while the overlap grows.
///
/// For a patch, its share. A solid at rest has a Motion().
template <class Contact>
double volume_rate(const Contact& contact, const PlacedSolid& a, const PlacedSolid& b,
                   const Motion& motion_a, const Motion& motion_b) noexcept {
  const Wrenches push =
      both_wrenches({contact.force, contact.torque}, world_point(b, Eigen::Vector3d::Zero()),
                    world_point(a, motion_a.about), world_point(b, motion_b.about));
  return -(push.on_a.force.dot(motion_a.velocity) +
           push.on_a.torque.dot(motion_a.angular_velocity)) -
         (push.on_b.force.dot(motion_b.velocity) + push.on_b.torque.dot(motion_b.angular_velocity));
}

}  // namespace ist

// Contact laws: from a volume to a force, for loops and engines without a contact solver of their
// own. docs/engines.md explains which to choose.
//
// Units: [u] the meshes' length, [s] time, [force], and [mass] = [force·s²/u]. With u = m and force
// = N mass is kg; with u = mm and force = mN mass is kg too.
//
// A force of k · Penetration::force is not a contact law (docs/engines.md, *What a volume
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

/// Motion of B relative to A about B's origin, in axes that do not turn with A: differences of
/// world velocities there. `a`, `b`: the solids of the query.
inline Motion relative_motion(const PlacedSolid& a, const PlacedSolid& b, const Motion& motion_a,
                              const Motion& motion_b) noexcept {
  const Eigen::Vector3d origin = world_point(b, Eigen::Vector3d::Zero());
  const auto at_origin = [&](const PlacedSolid& solid, const Motion& motion) -> Eigen::Vector3d {
    return motion.velocity +
           motion.angular_velocity.cross(origin - world_point(solid, motion.about));
  };
  return {at_origin(b, motion_b) - at_origin(a, motion_a),
          motion_b.angular_velocity - motion_a.angular_velocity};
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
  patch.force = contact.force;
  patch.torque = contact.torque;
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
/// `motion`: of B relative to A about B's origin [u/s, rad/s], as relative_motion() returns it.
/// `origin_b`: [u] of B's pose, world. `step`: [s] since the last call, by which the friction
/// springs are stretched. `patches`: as contact_patches() wrote them. Patches beyond
/// ContactMemory::kPatches have no friction. Patches that are gone are forgotten.
///
/// The law gains no energy, except where the division into patches changes: see docs/engines.md.
///
/// No allocation, lock or exception. Any thread; a memory belongs to one contact.
inline ContactForce contact_force(const ContactLaw& law, std::span<const ContactPatch> patches,
                                  const Motion& motion, const Eigen::Vector3d& origin_b,
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

// Flat contacts by the corners of their support polygon, for engines that solve contact points.

namespace IST_API ist {

/// A contact of two flat faces as points at the corners of the hull of what the faces share.
///
/// The patches of contact_patches() lie within their parts of a face. A body at the edge of a table
/// then tips before its centre is over the edge, since no point there can push. The corners span
/// all forces and torques that the face can transmit. By Measure::exact they sum to the contact's
/// volume, force and torque. By spheres they sum to those of the overlap between the two planes,
/// which spheres blur.
///
/// Give it the whole contact, then the faces of both sides near it, then ask for the corners.
/// Without allocation, lock or exception; a polygon belongs to one thread.
class SupportPolygon {
 public:
  static constexpr std::size_t kFaces = 256;  ///< of a side

  /// `origin_b`: [u] of B's pose, world. `axes`: columns are those of the body on which the corners
  /// keep their names, world. `reach`: [u] no point of the contact is further from its centroid.
  /// `blur`: [u] how far the spheres of both stick out (AssetView::protrusion() times the scale);
  /// 0: the contact is by Measure::exact.
  SupportPolygon(const Penetration& whole, const Eigen::Vector3d& origin_b,
                 const Eigen::Matrix3d& axes, double reach, double blur) noexcept;

  /// The faces of an asset that keeps a mesh, of a half-space or of a box. False for others.
  bool add(bool of_b, const PlacedSolid& solid) noexcept;
  /// [u] World, anticlockwise from outside. What does not face the contact is left out.
  void add_triangle(bool of_b, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                    const Eigen::Vector3d& r) noexcept;
  /// A face without end. `normal`: unit, outward.
  void add_plane(bool of_b, const Eigen::Vector3d& normal, const Eigen::Vector3d& point) noexcept;

  /// True if the faces given so far of that side may be part of a polygon. Otherwise corners()
  /// returns nothing, whatever the other side has.
  bool has_faces(bool of_b) const noexcept {
    return flat_ && (sides_[of_b].endless || sides_[of_b].count > 0);
  }

  /// Writes the corners, those of the true hull if they fit and of as many directions as fit if
  /// not. Returns how many, or nothing if the contact is not flat or if three do not fit:
  /// then use the patches. Where the faces are apart, and spheres alone reach from one to the
  /// other, the depths are negative, the gaps, and no corner has a volume or a force. Ids are those
  /// of directions in `axes`, with the highest bit set: patches have others.
  std::optional<std::size_t> corners(std::span<ContactPatch> patches) const noexcept;

 private:
  struct Corner {
    double u, v, z;  // [u] from the middle along the polygon's axes and the normal
  };
  using Face = std::array<Corner, 3>;
  /// The plane of one side's faces: z = height + u · slope[0] + v · slope[1].
  struct Plane {
    double height = 0, slope[2] = {0, 0};
    double at(const Corner& x) const { return height + x.u * slope[0] + x.v * slope[1]; }
    bool is_along(const Plane& other, double most) const;  ///< slopes differ by less
  };
  struct Side {
    std::array<Face, kFaces> faces;
    std::size_t count = 0;
    bool endless = false;
    Plane plane;  // of an endless one, or of a face in the middle, or of the first one
    bool has_middle = false;
  };
  struct Hull;

  Corner corner(const Eigen::Vector3d& x) const;
  static Plane plane_of(const Face& face);
  bool choose_plane(bool of_b, Plane& plane) const;
  bool is_near(const Face& face, const Plane& plane) const;
  /// Away from the middle, where a flat contact by Measure::exact may be rounded or have a step.
  bool is_at_rim(const Face& face) const;
  void add_mesh(bool of_b, const PlacedAsset& solid) noexcept;

  Penetration whole_;
  Eigen::Vector3d origin_b_, middle_, normal_, axis_[2];
  double area_ = 0, torsion_ = 0, reach_ = 0, near_ = 0;
  bool blurred_ = false;
  bool flat_ = true;  // so far
  std::array<Side, 2> sides_;
};

/// contact_patches() for engines that solve contact points: the corners of the support polygon if
/// the contact is flat (SupportPolygon), else the patches as they are. The whole contact stays that
/// of contact_patches().
ContactPatches contact_points(const PlacedSolid& a, const PlacedSolid& b,
                              const ContactSettings& settings, Workspace& workspace,
                              std::span<ContactPatch> patches) noexcept;

}  // namespace ist
