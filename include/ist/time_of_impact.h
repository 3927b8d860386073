#pragma once

#include <Eigen/Core>
#include <cstdint>

#include <ist/query.h>
#include <ist/types.h>

// Continuous collision: how long two moving solids stay clear of each other. Lengths are [u], times
// [T], a unit of the caller's (a second, a step); angles are radians.

namespace IST_API ist {

/// The motion that takes an object from one pose to another in the time `duration` > 0: `about`
/// moves straight, and the object turns at constant speed about one axis, on the shorter arc
/// (slerp).
///
/// It ends at `to` up to rounding. `scale` is the object's (PlacedAsset::scale). An invalid
/// pose or duration yields a Motion that queries reject.
Motion motion_between(const Pose& from, const Pose& to, double duration,
                      const Eigen::Vector3d& about = Eigen::Vector3d::Zero(),
                      double scale = 1) noexcept;

/// The pose after `time` of a motion that starts at `start`. `scale` is the object's.
Pose moved(const Pose& start, const Motion& motion, double time, double scale = 1) noexcept;

/// The motions of two placed solids.
struct Motions {
  Motion a = {}, b = {};
};

/// The outcome for two moving solids. With a status other than ok it is no_impact.
enum class ImpactKind : std::uint32_t {
  no_impact = 0,  ///< they stay clear of each other over the whole interval
  /// At `time` they are no further apart than the tolerance, and approaching.
  impact = 1,
  /// They stay clear up to `time`. A later contact can be neither shown nor ruled out: the error of
  /// the solids or of rounding exceeds the requested tolerance. The error of a solid is
  /// AssetView::mesh_error; without a mesh it is how far cover balls stick out, 1 to 10 % of
  /// the size.
  unresolved = 2,
  /// They touch or overlap at the start: surfaces meet, or one solid contains the other.
  overlapping = 3,
};

struct ImpactSettings {
  double duration = 1;  ///< [T] > 0: the interval is [0, duration]

  /// [u] An impact is reported when the gap is between a half of this and this. Zero, a negative
  /// value or NaN: a thousandth of the smaller solid's bounding radius (of the asset's, if the
  /// other is a shape), or ten times the error of the assets' meshes if that is more.
  ///
  /// Solids that start nearer have an impact only if they approach. Over several calls they may
  /// come nearer than a half of this, but never to zero.
  double tolerance = 0;

  std::uint32_t max_visits = 0;  ///< count of node pairs visited, the earliest first; 0: no limit
};

struct TimeOfImpact {
  ImpactKind kind = ImpactKind::no_impact;
  /// budget_exhausted: a limit, or the workspace's capacity; they stay clear up to `time`.
  /// invalid_input also for a motion with NaN or Inf, a duration that is not > 0, or Inf, and a
  /// motion over 1e60 sizes.
  QueryStatus status = QueryStatus::ok;
  /// [T] in [0, duration]. Certified for every kind: the solids do not touch in [0, time]. 0
  /// proves no contact at 0, except for overlapping and unresolved.
  double time = 0;
  /// [u] Certified bounds of the solids' distance at `time`. The lower end is a bound proven for
  /// all parts over the whole motion, not a measurement: it is nearly 0 where parts slide past each
  /// other closely, also for an impact. `time` is the proof that the solids do not touch.
  ///
  /// For no_impact the upper end is infinite; all zero for overlapping.
  double distance_min = 0, distance_max = 0;
  /// For impact and unresolved: [u] points of A and B at `time`, world, no further apart than
  /// distance_max. Other points may be nearer by a part of the tolerance.
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< likewise: unit, from A to B, world
  std::uint32_t node_visits = 0;                     ///< node pairs visited
  /// Visited pairs of triangles or spheres, or of one of these and a shape.
  std::uint32_t surface_pairs = 0;
};

/// A time up to which two moving solids stay clear of each other. Conservative advancement: `time`
/// is a proof at any speed, not a sample.
///
/// A solid is represented by the mesh in its asset (AssetView::has_mesh), or else by the cover
/// balls of its inner spheres.
///
/// With a shape, it is certified as far as the shape's distances are: see each shape. Height
/// fields, distance grids and functions give no direction: the other solid's faces are divided into
/// pieces as small as the gap, so large flat faces near them take many visits. Parts of a distance
/// grid or a function that lie wholly inside the other solid at the start are not found. Two
/// fields: missing_data.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not. The
/// same bits on every x86-64 level.
TimeOfImpact time_of_impact(const PlacedSolid& a, const PlacedSolid& b, const Motions& motions,
                            const ImpactSettings& settings, Workspace& workspace) noexcept;

}  // namespace ist
