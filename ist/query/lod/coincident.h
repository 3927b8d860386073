#pragma once

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "query/base/relative_pose.h"
#include "query/lod/coincidence.h"

namespace ist {

/// Whether both are the same bytes, and contain a coarser level.
inline bool are_one_asset(const AssetHeader& a, const AssetHeader& b) noexcept {
  return a.detail_count > 0 &&
         (&a == &b || (a.content_hash == b.content_hash && a.file_bytes == b.file_bytes));
}

/// (1 − weight) of x and the weight's part of y.
Penetration mix(const Penetration& x, const Penetration& y, double weight) noexcept;

/// Adds `step` [u³] times a weight's slope to the gradients of a mix by it: `step` is what the mix
/// grows by as the weight goes from 0 to 1.
void add_slope(const PoseSlope& slope, double step, const RelativePose& pose,
               Penetration& mixed) noexcept;

}  // namespace ist
