#pragma once

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"

namespace ist {

struct Binned {
  ContactBins& bins;
  std::uint32_t filled;
  const RelativePose& pose;
  double radius;  ///< of the binned tree's root, A's unit frame
};

/// Distributes the difference between a blend and its `part` over the part's `count` patches by
/// volume. If there are none, as after a stopped query, one patch stands for the whole. Returns
/// their number.
std::size_t spread(const Penetration& part, const Penetration& whole, std::size_t count,
                   std::span<ContactPatch> patches) noexcept;

/// Divides the contact into patches, which sum to `whole`; returns their number.
std::size_t write_patches(const Binned& binned, const Penetration& whole,
                          std::span<ContactPatch> patches) noexcept;

/// Derives the other members from centroids, volumes and wrenches about B's origin.
void finish_patches(std::span<ContactPatch> patches, const Pose& b, double deepest) noexcept;

}  // namespace ist
