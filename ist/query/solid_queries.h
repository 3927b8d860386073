#pragma once

#include <span>

#include <ist/query.h>
#include <ist/time_of_impact.h>

#include "query/base/relative_pose.h"

// The public queries for two assets, or for a shape and an asset in this order.

namespace ist {

Penetration find_penetration(const PlacedAsset& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept;
Penetration find_penetration(const PlacedShape& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept;

/// `enough`: once the distance is known to be no more than this [u], only distance_max is set.
Separation find_separation(const PlacedAsset& a, const PlacedAsset& b,
                           const SeparationSettings& settings, Workspace& workspace,
                           double enough = 0) noexcept;
/// True if inner spheres of both contain a point near the middle of the overlap `found`, which
/// proves that the solids overlap. May be false for solids that do.
bool spheres_share(const PlacedAsset& a, const PlacedAsset& b, const Penetration& found) noexcept;
Separation find_separation(const PlacedShape& a, const PlacedAsset& b,
                           const SeparationSettings& settings, Workspace& workspace) noexcept;

ContactPatches find_patches(const PlacedAsset& a, const PlacedAsset& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept;
ContactPatches find_patches(const PlacedShape& a, const PlacedAsset& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept;

YesNoAnswer find_overlap(const PlacedAsset& a, const PlacedAsset& b, Workspace& workspace) noexcept;
YesNoAnswer find_overlap(const PlacedShape& a, const PlacedAsset& b, Workspace& workspace) noexcept;

TimeOfImpact find_impact(const PlacedAsset& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept;
TimeOfImpact find_impact(const PlacedShape& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept;

/// penetration() by Measure::exact.
Penetration exact_penetration(const PlacedAsset& a, const PlacedAsset& b,
                              const PenetrationSettings& settings, const RelativePose& pose,
                              Workspace& workspace) noexcept;

/// contact_patches() and overlap_outline() by Measure::exact. `divides`: splits parts into octants.
OverlapOutline exact_patches(const PlacedAsset& a, const PlacedAsset& b,
                             const ContactSettings& settings, Workspace& workspace,
                             std::span<ContactPatch> patches, std::span<OutlineSegment> segments,
                             bool divides) noexcept;

}  // namespace ist
