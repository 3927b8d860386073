#pragma once

#include <Eigen/Core>
#include <cstdint>

#include <ist/api.h>
#include <ist/field.h>
#include <ist/pose.h>
#include <ist/query.h>

// How long two moving solids stay clear of each other. Lengths are [u], times [T], a unit of the
// caller's own (a second, a step); angles are radians.

namespace IST_API ist {

/// A rigid motion of constant velocity: one point of the object goes straight on, and the object
/// turns about it.
struct Motion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [u/T] of `about`, world
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/T] world
  /// [u] the point that goes straight on, its centre of mass for a free body. In the object's own
  /// frame, before its scale.
  Eigen::Vector3d about = Eigen::Vector3d::Zero();
};

/// The motion that takes an object from one pose to another in the time `duration` > 0: `about`
/// goes straight from place to place, and the object turns at constant speed about one axis, the
/// shorter way (slerp).
///
/// It ends at `to` but for rounding. `scale` is the object's (PlacedTree::scale).
/// Poses that no query takes, or such a duration, give a motion that no query takes.
Motion motion_between(const Pose& from, const Pose& to, double duration,
                      const Eigen::Vector3d& about = Eigen::Vector3d::Zero(),
                      double scale = 1) noexcept;

/// The object at a time of its motion, which starts where it is placed.
PlacedTree moved(const PlacedTree& start, const Motion& motion, double time) noexcept;
PlacedField moved(const PlacedField& start, const Motion& motion, double time) noexcept;

/// Of two placed solids.
struct Motions {
  Motion a, b;
};

enum class ImpactStatus : std::uint32_t {
  no_impact = 0,  ///< they stay clear of each other over the whole interval
  /// At `time` they are no further apart than the tolerance, and approaching.
  impact = 1,
  /// They stay clear up to `time`. What comes then cannot be told: what is known of the solids
  /// (TreeView::field_error; without a field how far cover balls stick out, 1 to 10 % of the size)
  /// or rounding is no finer than the tolerance asked for.
  unresolved = 2,
  overlapping = 3,       ///< they meet at the start: surfaces cross, or one solid holds the other
  budget_exhausted = 4,  ///< a limit, or the workspace's capacity; they stay clear up to `time`
  /// The answer is all zero. One of: as QueryStatus::invalid_input; a motion with NaN or Inf; a
  /// duration that is negative, NaN or Inf; a motion that leads 1e60 sizes away.
  invalid_input = 5,
  /// An asset holds no spheres (QueryStatus::not_held). All numbers of the answer are NaN.
  not_held = 6,
};

struct ImpactSettings {
  double duration = 1;  ///< [T] ≥ 0: what happens in [0, duration] is asked

  /// [u] An impact is reported when the gap has come down to between a half of this and this. Zero,
  /// a negative value or NaN: a thousandth of the smaller solid's bounding radius (of B's, where A
  /// is a field), or ten times what the assets' fields may err if that is more.
  ///
  /// What starts nearer is an impact only if it approaches; over several calls it may come nearer
  /// than a half of this, never to nought.
  double tolerance = 0;

  std::uint32_t max_visits = 0;  ///< count of pairs of nodes looked at, the earliest first; 0: any
  double deadline_us = 0;        ///< [µs] wall clock from the call; 0, negative or NaN: none
};

struct TimeOfImpact {
  ImpactStatus status = ImpactStatus::no_impact;
  /// [T] in [0, duration]. Certified for every status: the solids do not touch in [0, time], at 0
  /// not even where it is 0 but for overlapping and unresolved.
  double time = 0;
  /// [u] The solids' distance at `time` lies in here, certified.
  /// The lower end is what was shown of all parts on the whole way, and not measured: where parts
  /// slide past each other closely it is next to 0, of an impact too. That the solids do not touch
  /// is what `time` says.
  /// Of no_impact and budget_exhausted the upper end is infinite; all zero if overlapping.
  double distance_min = 0, distance_max = 0;
  /// Of impact and unresolved: [u] points of A and B at `time`, world, no further apart than
  /// distance_max. Others may be nearer by a part of the tolerance.
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< likewise: unit, from A to B, world
  std::uint32_t node_visits = 0;                     ///< pairs of nodes looked at
  /// Of them pairs of triangles, of spheres, or of a field with one of these.
  std::uint32_t surface_pairs = 0;
};

/// Up to when two moving solids stay clear of each other: conservative advancement, so that `time`
/// is a proof at any speed, not a sample.
///
/// A solid is looked at by the surface in its asset (TreeView::has_field), or else by the cover
/// balls of its inner spheres.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not.
/// The same bits on every x86-64 level.
TimeOfImpact time_of_impact(const PlacedTree& a, const PlacedTree& b, const Motions& motions,
                            const ImpactSettings& settings, Workspace& workspace) noexcept;

/// The same for a field and a tree.
///
/// Certified as far as the field's distances are: see each field.
/// Height fields, distance grids and functions tell no direction: B's faces are looked at in pieces
/// as small as the gap, so large flat faces near them take many visits.
/// Parts of a distance grid or a function that lie wholly inside B at the start are not seen.
TimeOfImpact time_of_impact(const PlacedField& a, const PlacedTree& b, const Motions& motions,
                            const ImpactSettings& settings, Workspace& workspace) noexcept;

}  // namespace ist
