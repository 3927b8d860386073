#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include <ist/cover_spheres.h>

namespace ist {

/// Equal meshes of which as many spheres are asked for, and their covers by count.
struct CoverPart {
  const ClosedMesh* mesh;
  std::size_t count;   ///< 0: a share of the total
  std::size_t copies;  ///< meshes
  std::map<std::size_t, SphereCover> tried = {};
};

/// Adds to `parts`, for each mesh, the part that it belongs to; says which.
std::vector<std::size_t> parts_of(std::span<const ClosedMesh> meshes,
                                  const SphereCoverSettings& settings,
                                  std::vector<CoverPart>& parts);

inline constexpr int kSharingRounds = 6;  ///< at most

/// Shares the total among the parts without a count: evenly at first, then by what was measured.
/// The counts whose largest protrusion was the smallest.
///
/// `cover(counts)` is to cover each part with so many spheres. Throws Error where the total is too
/// small.
std::vector<std::size_t> shared_counts(
    const std::vector<CoverPart>& parts, std::size_t total,
    const std::function<void(const std::vector<std::size_t>&)>& cover);

}  // namespace ist
