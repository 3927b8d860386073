#pragma once

#include <span>

#include <ist/overlap.h>
#include <ist/query.h>
#include <ist/time_of_impact.h>

// The public queries of two assets, and of a field and an asset, in this order.

namespace ist {

Penetration find_penetration(const PlacedTree& a, const PlacedTree& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept;
Penetration find_penetration(const PlacedField& a, const PlacedTree& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept;

/// `enough`: once the distance is known to be no more than this [u], distance_max is all that is
/// asked for.
Separation find_separation(const PlacedTree& a, const PlacedTree& b,
                           const SeparationSettings& settings, Workspace& workspace,
                           double enough = 0) noexcept;
Separation find_separation(const PlacedField& a, const PlacedTree& b,
                           const SeparationSettings& settings, Workspace& workspace) noexcept;

ContactPatches find_patches(const PlacedTree& a, const PlacedTree& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept;
ContactPatches find_patches(const PlacedField& a, const PlacedTree& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept;

Overlapping find_overlap(const PlacedTree& a, const PlacedTree& b, Workspace& workspace) noexcept;
Overlapping find_overlap(const PlacedField& a, const PlacedTree& b, Workspace& workspace) noexcept;

TimeOfImpact find_impact(const PlacedTree& a, const PlacedTree& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept;
TimeOfImpact find_impact(const PlacedField& a, const PlacedTree& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept;

}  // namespace ist
