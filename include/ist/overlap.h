#pragma once

#include <cstdint>

#include <ist/api.h>
#include <ist/query.h>

namespace IST_API ist {

/// Whether two placed solids share a point. Yes and no are certain, since inner spheres lie in the
/// solids and cover balls contain them.
enum class Overlapping : std::uint32_t {
  no = 0,   ///< no two cover balls meet: the solids are apart
  yes = 1,  ///< two inner spheres meet: the solids overlap
  /// Neither was shown: the solids are near each other or hardly touch, or 256 pairs of nodes have
  /// been opened. Also for invalid_input.
  unknown = 2,
};

/// Stops at the first meeting pair of inner spheres: a fraction of the time of a penetration. With
/// a field, it is certain as far as the field's distances are: see each field. Two fields: unknown.
Overlapping overlap(const PlacedSolid& a, const PlacedSolid& b, Workspace& workspace) noexcept;

/// Whether two placed solids come within `margin` [u] ≥ 0 of each other. Yes and no are certain.
///
/// If both assets keep a mesh, `unknown` is left only where the distance is the margin to rounding
/// and the meshes' errors. Otherwise inner spheres and their covers decide, as above. Takes about
/// as long as overlap(), or a few microseconds, unless the distance is near the margin. A margin
/// that is negative, or NaN: unknown.
Overlapping overlap(const PlacedSolid& a, const PlacedSolid& b, double margin,
                    Workspace& workspace) noexcept;

}  // namespace ist
