#pragma once

#include <ist/api.h>

namespace IST_API ist {

/// Grids of the modes after Weller and Zachmann (GridMode other than banded).
///
/// 0, or a negative count of refinements, is automatic: sizes are chosen from how much of its box
/// the solid fills, and that of the distance grid also from the free memory. The packing depends
/// on `start`, `refinements`, `rounds_per_level` and, for uniform, `resolution`; the rest affects
/// speed and memory.
struct GridSettings {
  unsigned start = 0;  ///< cells on the solid's longest side, first prototype grid; 1 … 1024
  /// Cells on the longest side of the fixed grid (uniform: both grids; implicit: the distance grid)
  /// or of the first distance grid (hybrid). Except for uniform it is rounded up to start · 2^k. At
  /// most 1024.
  unsigned resolution = 0;
  int refinements = -1;           ///< how often the prototype grid is split in 8; 5 if automatic
  unsigned rounds_per_level = 0;  ///< rounds before a refinement; 2 if automatic
};

}  // namespace ist
