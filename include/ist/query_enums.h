#pragma once

#include <cstdint>

#include <ist/api.h>

// Options and statuses of queries. Device code may include it.

namespace IST_API ist {

enum class QueryStatus : std::uint32_t {
  ok = 0,  ///< finished: the gradients are exactly those of the returned volume
  /// A limit of the settings or the workspace's capacity stopped the descent. volume_min and
  /// volume_max still contain the finished sum (exact: the true volume).
  budget_exhausted = 1,
  /// All numbers of the answer are NaN, its counts 0. The cause is a pose with NaN or Inf; a
  /// quaternion of length 0; a scale ≤ 0; an empty tree; a field's number out of range; sizes or
  /// distances more than 1e60 : 1 apart; a measure that has no name; contact patches without room
  /// for one; or a workspace that was moved from.
  invalid_input = 2,
  /// A solid lacks what the measure needs. Measure::exact needs both solids' meshes
  /// (TreeView::has_mesh; a field has none), the others need spheres. All numbers of the
  /// answer are NaN.
  not_held = 3,
  /// Finished, but the predicted error is larger than PenetrationSettings::relative_error: an asset
  /// has no mesh or one that errs more, or a pair budget or coincident copies left
  /// coarser spheres. The gradients are exactly those of the returned volume.
  error_exceeded = 4,
};

/// What represents the solid.
enum class Measure : std::uint32_t {
  /// Matched spheres, whose volumes sum to the solid's. Where they are too coarse for the contact
  /// of two solids of unlike sizes, the meshes answer as for `exact`, if both assets keep theirs
  /// (PenetrationSettings::spheres_only).
  matched = 0,
  inner = 1,  ///< inner spheres: a certified lower bound of the true volume
  /// The two meshes themselves: the true volume and its gradients, and bounds of the true volume.
  /// Needs the mesh in both assets (TreeView::has_mesh).
  exact = 2,
};

}  // namespace ist
