#pragma once

#include <ist/query.h>

#include "query/base/relative_pose.h"

namespace ist {

/// penetration() by Measure::exact. `pose` is that of the two.
Penetration exact_penetration(const PlacedAsset& a, const PlacedAsset& b,
                              const PenetrationSettings& settings, const RelativePose& pose,
                              Workspace& workspace) noexcept;

/// contact_patches() and overlap_outline() by Measure::exact. `divides`: parts into octants, as far
/// as there is room.
OverlapOutline exact_patches(const PlacedAsset& a, const PlacedAsset& b,
                             const ContactSettings& settings, Workspace& workspace,
                             std::span<ContactPatch> patches, std::span<OutlineSegment> segments,
                             bool divides) noexcept;

}  // namespace ist
