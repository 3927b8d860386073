#pragma once

#include <cstdint>

#include <ist/api.h>
#include <ist/field.h>
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

/// Stops at the first meeting pair of inner spheres: a fraction of the time of a penetration.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not.
Overlapping overlap(const PlacedTree& a, const PlacedTree& b, Workspace& workspace) noexcept;

/// The same for a field, certain as far as its distances are: see each field.
Overlapping overlap(const PlacedField& a, const PlacedTree& b, Workspace& workspace) noexcept;

}  // namespace ist
