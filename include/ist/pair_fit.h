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
  bool has_mesh = true;      ///< both assets store their meshes (TreeView::has_mesh)
  /// The ratio is 4 or more: volumes and forces by spheres alone are misleading. With both meshes
  /// Measure::matched goes over to these (PenetrationSettings::spheres_only).
  bool needs_mesh = false;

  bool fits() const noexcept { return has_mesh || !needs_mesh; }
};

/// Takes nanoseconds. For empty trees, and scales that are not > 0, all members have their
/// defaults.
PairFit pair_fit(const PlacedTree& a, const PlacedTree& b) noexcept;

}  // namespace ist
