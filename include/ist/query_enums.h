#pragma once

#include <cstdint>

#include <ist/api.h>

// What queries are asked for and answer with, by name. Device code may include it.

namespace IST_API ist {

enum class QueryStatus : std::uint32_t {
  ok = 0,  ///< finished: the gradients are exactly those of the returned volume
  /// A limit of the settings or the workspace's capacity stopped the descent: volume_min and
  /// volume_max still hold what they hold of a finished answer.
  budget_exhausted = 1,
  /// The answer is all zero. One of: a pose with NaN or Inf; a quaternion off unit length by more
  /// than 1e-3; a scale ≤ 0; an empty tree; sizes or distances more than 1e60 : 1 apart; a
  /// workspace that was moved from.
  invalid_input = 2,
  /// A solid does not hold what the measure needs: Measure::exact asks for both solids' meshes
  /// (TreeView::has_mesh; a field has none), the others for spheres. All numbers of the answer are
  /// NaN.
  not_held = 3,
};

/// What stands for the solid.
enum class Measure : std::uint32_t {
  matched = 0,  ///< matched spheres whose volumes sum to the solid's: the accurate one
  inner = 1,    ///< inner spheres: a certified lower bound of the true volume
  /// The two meshes themselves: the true volume and its gradients. The true volume lies between the
  /// bounds that the answer holds. Needs the mesh in both assets (TreeView::has_mesh).
  exact = 2,
};

/// Whether the surface that an asset holds (TreeView::has_field) is used.
///
/// A sphere that meets the other solid's surface has an exact part inside it; a lens of two spheres
/// knows nothing of the surface between a sphere and its neighbours.
enum class FieldUse : std::uint32_t {
  /// The finer tree's spheres meet the coarser one's surface where its spheres are too coarse for
  /// the contact; trees of like size in deeper contact are summed by lenses, and what is between is
  /// blended smoothly. Without a field in the coarser asset: lenses.
  automatic = 0,
  never = 1,   ///< lenses alone
  always = 2,  ///< the surface alone, whatever it costs
};

}  // namespace ist
