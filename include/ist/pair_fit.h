#pragma once

#include <ist/api.h>
#include <ist/query.h>

namespace IST_API ist {

/// How two assets suit each other, whatever their poses.
struct PairFit {
  /// [u] under the objects' scales: mean radius of the matched spheres, over the share of the solid
  /// that inner spheres cover. What is finer than that, the spheres do not know.
  double grain_a = 0, grain_b = 0;
  double ratio = 1;          ///< ≥ 1, of the coarser grain over the finer
  bool a_is_coarser = true;  ///< or both are alike
  bool has_surface = true;   ///< the coarser asset holds its surface (TreeView::has_field)
  /// Volumes and forces by the spheres of both alone mislead: the ratio is 4 or more. The coarser
  /// one's surface helps, where it holds one and FieldUse lets it.
  bool needs_surface = false;

  bool fits() const noexcept { return has_surface || !needs_surface; }
};

/// Takes nanoseconds. For empty trees, and scales that are not > 0, all is as by default.
PairFit pair_fit(const PlacedTree& a, const PlacedTree& b) noexcept;

}  // namespace ist
