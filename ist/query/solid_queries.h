#pragma once

#include <span>

#include <ist/query.h>
#include <ist/time_of_impact.h>

// The public queries of two assets, and of a shape and an asset, in this order.

namespace ist {

Penetration find_penetration(const PlacedAsset& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept;
Penetration find_penetration(const PlacedShape& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept;

/// `enough`: once the distance is known to be no more than this [u], distance_max is all that is
/// asked for.
Separation find_separation(const PlacedAsset& a, const PlacedAsset& b,
                           const SeparationSettings& settings, Workspace& workspace,
                           double enough = 0) noexcept;
/// Whether inner spheres of both are seen to contain a point near the middle of an overlap that was
/// found: then the solids do overlap. May miss.
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

}  // namespace ist
