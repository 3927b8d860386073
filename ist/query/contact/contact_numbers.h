#pragma once

#include <cmath>
#include <cstdint>

#include "base/vec3.h"

// Numbers of a contact's division that the CPU and the GPU share.

namespace ist {

/// The largest number of bins of a contact: leaf blocks of 65,536 spheres.
inline constexpr std::uint32_t kMostContactBins = 4096;

/// A side of a division with less than this share of the contact's pull is no patch of its own:
/// small parts that come and go at the rim must not rename the patches.
inline constexpr double kLeastContactShare = 0.01;

/// A pull that another cancels costs as much as if it acted half a radius of the solid away.
inline constexpr double kContactBend = 0.25;

/// Solids of fewer leaf blocks than this are too coarse to be divided, if the other is finer.
inline constexpr std::uint32_t kFewContactBlocks = 16;

/// An area of no more than this share of volume^(2/3) is rounding: the solid lies wholly inside.
inline constexpr double kPushRounding = 1e-9;

/// True if contacts are divided along B's tree: the smaller solid's, whose contacts stay with its
/// corners while it slides, or the only one that is fine enough by its leaf blocks.
IST_HD inline bool divides_b(std::uint32_t blocks_a, double radius_a, std::uint32_t blocks_b,
                             double radius_b) noexcept {
  const std::uint32_t fewer = blocks_a < blocks_b ? blocks_a : blocks_b;
  if (fewer < kFewContactBlocks && blocks_a != blocks_b) return blocks_b > blocks_a;
  return radius_b <= radius_a;
}

/// The central axis of a patch's wrench on B, world.
struct PatchAxis {
  Vec3 point, normal;
  double area, depth, torsion;

  /// `origin`: [u] that the torque is about; `deepest`: [u] upper limit of the depth.
  IST_HD static PatchAxis of(double volume, const Vec3& centroid, const Vec3& force,
                             const Vec3& torque, const Vec3& origin, double deepest) noexcept {
    PatchAxis axis = {centroid, {0, 0, 0}, 0, 0, 0};
    const double area = norm(force);
    if (!(area > kPushRounding * std::cbrt(volume * volume))) return axis;
    axis.area = area;
    axis.normal = force / area;
    axis.depth = volume / area < deepest ? volume / area : deepest;
    const Vec3 moment = torque - cross(centroid - origin, force);
    axis.point = centroid + cross(axis.normal, moment) / area;
    axis.torsion = dot(axis.normal, moment);
    return axis;
  }
};

}  // namespace ist
