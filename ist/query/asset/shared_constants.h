#pragma once

#include "base/host_device.h"

// Constants of the queries, on the CPU and on the GPU.

namespace ist {

/// The level under the leaves: a "node" is a single sphere, block · 16 + lane.
inline constexpr int kSphereLevel = -1;

/// The largest ratio of sizes and distances, in sizes of A: squares of squares stay finite.
inline constexpr double kFarthestPose = 1e60;

/// Quaternions and normals of these lengths are normalised: their squares are neither 0 nor Inf.
inline constexpr double kShortestDirection = 1e-150, kLongestDirection = 1e150;

/// Largest length or distance of a shape; its square stays finite.
inline constexpr double kLongestLength = 1e150;

/// The ratio of sizes from which on arithmetic is in double. For spheres of similar sizes float
/// keeps a sum of lenses to 1e-5: it rounds only differences to the nearest block's origin, which
/// are a few radii long.
inline constexpr double kSingleRatio = 64;

/// Solid angles below this do not decide which side a centre is on.
inline constexpr double kLeastAngle = 1e-6;
/// An edge is too near a ball's centre within this squared fraction of the radius: the error of its
/// angle is the rounding of positions over their distance.
inline constexpr double kOnEdge2 = 0x1p-28;
/// The fraction of its radius by which such a ball is moved along an axis, in a direction in which
/// edges of manufactured parts do not run.
IST_HD constexpr double moved_along(int axis) {
  return 0x1p-12 * (axis == 0 ? 0.43877 : axis == 1 ? 0.61803 : 0.65236);
}

// The number of overlapping sphere pairs is kPairShare · n_a n_b · ball(r_a + r_b) · (V + kPairRim
// (r_a + r_b) √(V L)). Here n is spheres per volume, r a mean radius, V the overlap, L the size of
// the smaller solid. The second term counts the contact's rim, whose area grows as √(V L) for round
// contacts. Fitted to the oracle's rows of eledino with 1,000 to 64,000 spheres, V by 250: 90 % of
// all counts lie within a factor of two. The fit moves answers between levels and nothing else.
inline constexpr double kPairShare = 0.38;
inline constexpr double kPairRim = 1.6;

// Fractions of the pair budget: a level that needs at most the first answers alone, one that needs
// the second or more is not used.
inline constexpr double kLevelAlone = 0.7, kLevelNone = 1;
// The same fractions for the finest level if pairs are estimated by a coarse traversal, which gives
// 0.4 to 7 times the pairs of the oracle's contacts, and more than twice in half of them. Too low
// an estimate overdraws the budget by at most a quarter.
inline constexpr double kLookAlone = 0.35, kLookNone = 0.5;

/// Spheres below this fraction of the others' volume count as smaller.
inline constexpr double kAlikeVolume = 0.5;

// Displacements of coincident instances, in mean radii: up to the first, unlike levels answer
// alone; from the second on, like ones do. Equal spheres lose their correlation within half a
// radius; the rest of the interval makes the transition smooth.
inline constexpr double kCopyAlone = 0.4, kCopyApart = 1.6;

// Quick looks: nodes' balls lie within kPokeOut root radii of the root's centre, since each
// contains spheres of the root's ball and is hardly larger than it. The overlap of a solid smaller
// than kSpeck of the other is taken as 0.
inline constexpr double kPokeOut = 3;
inline constexpr double kSpeck = 1e-9;
/// The least distance of two centres: with it coincident equal balls overlap by their whole volume.
inline constexpr double kLeastDistance = 1e-18;

}  // namespace ist
