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
  /// distances more than 1e60 : 1 apart; a measure or a surface use that has no name; contact
  /// patches without room for one; or a workspace that was moved from.
  invalid_input = 2,
  /// A solid lacks what the measure needs. Measure::exact needs both solids' meshes
  /// (TreeView::has_mesh; a field has none), the others need spheres. SurfaceUse::always needs the
  /// surface of the coarser one. All numbers of the answer are NaN.
  not_held = 3,
  /// Finished, but the predicted error is larger than PenetrationSettings::relative_error: an asset
  /// has no mesh, its mesh was simplified too much, or a pair budget or coincident copies left
  /// coarser spheres. The gradients are exactly those of the returned volume.
  error_exceeded = 4,
};

/// What represents the solid.
enum class Measure : std::uint32_t {
  matched = 0,  ///< matched spheres, whose volumes sum to the solid's: the accurate one
  inner = 1,    ///< inner spheres: a certified lower bound of the true volume
  /// The two meshes themselves: the true volume and its gradients, and bounds of the true volume.
  /// Needs the mesh in both assets (TreeView::has_mesh).
  exact = 2,
};

/// Whether the stored surface of an asset (TreeView::has_surface) is used.
///
/// A sphere is intersected exactly with the other solid's surface. A lens of two spheres does not
/// represent the surface between neighbouring spheres.
enum class SurfaceUse : std::uint32_t {
  /// The finer tree's spheres are intersected with the coarser one's surface where its spheres are
  /// too coarse for the contact. Trees of like size in deeper contact are summed by lenses, with a
  /// smooth blend in between. Without a surface in the coarser asset: lenses.
  automatic = 0,
  never = 1,   ///< lenses alone
  always = 2,  ///< the surface alone, whatever it costs; without one: QueryStatus::not_held
};

}  // namespace ist
