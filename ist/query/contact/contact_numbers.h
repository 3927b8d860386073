#pragma once

#include <cstdint>

// Numbers of a contact's division that the CPU and the GPU share.

namespace ist {

/// Bins of a contact, at most: 65,536 spheres by leaf blocks.
inline constexpr std::uint32_t kMostContactBins = 4096;

/// A side of a division with less than this share of the whole contact's pull is no patch of its
/// own: what comes and goes at the rim of a contact must not rename its patches.
inline constexpr double kLeastContactShare = 0.01;

/// A pull that another cancels costs as much as if it acted half a radius of the solid away.
inline constexpr double kContactBend = 0.25;

/// Solids of fewer leaf blocks than this are too coarse to be divided, if the other is finer.
inline constexpr std::uint32_t kFewContactBlocks = 16;

/// What lies wholly inside is pushed nowhere but by rounding: an area of no more than this share of
/// volume^(2/3).
inline constexpr double kPushRounding = 1e-9;

}  // namespace ist
