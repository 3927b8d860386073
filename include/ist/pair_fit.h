#pragma once

#include <ist/api.h>
#include <ist/query.h>

namespace IST_API ist {

/// Whether the sizes of two assets suit each other, independent of their poses.
struct PairFit {
  /// [u] under the objects' scales: mean radius of the matched spheres, over the share of the solid
  /// that inner spheres cover. The spheres do not resolve finer features.
  double grain_a = 0, grain_b = 0;
  double ratio = 1;          ///< ≥ 1, coarser grain over the finer
  bool a_is_coarser = true;  ///< or both are equal
  bool has_surface = true;   ///< the coarser asset stores its surface (TreeView::has_surface)
  /// The ratio is 4 or more: volumes and forces by spheres alone are misleading. The coarser
  /// one's surface helps, if it is stored and SurfaceUse allows it.
  bool needs_surface = false;

  bool fits() const noexcept { return has_surface || !needs_surface; }
};

/// Takes nanoseconds. For empty trees, and scales that are not > 0, all members have their
/// defaults.
PairFit pair_fit(const PlacedTree& a, const PlacedTree& b) noexcept;

}  // namespace ist
