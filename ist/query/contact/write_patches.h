#pragma once

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"

namespace ist {

/// How patches are written: what the bins hold, in which frame, and how many bins are filled.
struct Binned {
  ContactBins& bins;
  std::uint32_t filled;
  const RelativePose& pose;
  double radius;  ///< of the binned tree's root, A's unit frame
};

/// Makes the first `count` patches, which sum to `part`, a level of detail of a blend, sum to the
/// blend: the difference is spread by volume. If a limit stopped it before it found anything, one
/// patch is the whole. Returns how many there are.
std::size_t spread(const Penetration& part, const Penetration& whole, std::size_t count,
                   std::span<ContactPatch> patches) noexcept;

/// Divides what is binned; the patches' shares sum to those of the whole.
std::size_t write_patches(const Binned& binned, const Penetration& whole,
                          std::span<ContactPatch> patches) noexcept;

/// What follows from centroids, volumes and wrenches, these about B's origin.
void finish_patches(std::span<ContactPatch> patches, const Pose& b, double deepest) noexcept;

}  // namespace ist
