#pragma once

#include "base/host_device.h"

// Constants of the queries, on the CPU and on the GPU.

namespace ist {

/// The level under the leaves: a "node" is a single sphere, block · 16 + lane.
inline constexpr int kSphereLevel = -1;

/// Largest ratio of sizes and distances, in sizes of A. Beyond it nothing is told apart; below it
/// squares of squares stay finite.
inline constexpr double kFarthestPose = 1e60;

/// Quaternions and normals of these lengths are normalised: their squares are neither 0 nor Inf.
inline constexpr double kShortestDirection = 1e-150, kLongestDirection = 1e150;

/// Largest length or distance of a shape; its square stays finite.
inline constexpr double kLongestLength = 1e150;

/// From this ratio of sizes on all is in double. Float keeps a sum of lenses to 1e-5 while both
/// trees' spheres are of like size: what is rounded are differences to the nearest block's origin,
/// a few radii long.
inline constexpr double kSingleRatio = 64;

/// Solid angles smaller than this do not tell on which side a centre is.
inline constexpr double kLeastAngle = 1e-6;
/// Squared fraction of a ball's radius within which an edge is too near the centre: the error of
/// the angle under which the edge is seen is the rounding of positions over their distance.
inline constexpr double kOnEdge2 = 0x1p-28;
/// By this part of its radius such a ball is moved along an axis: in a direction in which no edge
/// of a made thing lies.
IST_HD constexpr double moved_along(int axis) {
  return 0x1p-12 * (axis == 0 ? 0.43877 : axis == 1 ? 0.61803 : 0.65236);
}

// Overlapping sphere pairs number kPairShare · n_a n_b · ball(r_a + r_b) · (V + kPairRim (r_a +
// r_b) √(V L)). Here n is spheres per volume, r a mean radius, V the overlap, and L the size of the
// smaller solid. The second term counts the contact's rim, whose area grows as √(V L) for round
// contacts. Fitted to the oracle's rows of eledino with 1,000 to 64,000 spheres, V by 250: 90 % of
// all counts lie within a factor of two. The fit moves answers between levels and nothing else.
inline constexpr double kPairShare = 0.38;
inline constexpr double kPairRim = 1.6;

// Parts of the pair budget: a level that needs at most the first answers alone, one that needs the
// second or more is not used.
inline constexpr double kLevelAlone = 0.7, kLevelNone = 1;
// The same for the finest level by a quick look, which estimates 0.4 to 7 times the pairs of the
// oracle's contacts, and in half of them more than twice. Where it estimates too few, the budget is
// overdrawn by at most a quarter.
inline constexpr double kLookAlone = 0.35, kLookNone = 0.5;

/// Spheres of less than this part of the other's volume are smaller.
inline constexpr double kAlikeVolume = 0.5;

// Displacements of coincident instances, in mean radii: up to the first, unlike levels answer
// alone; from the second on, like ones do. Equal spheres lose their correlation within half a
// radius; the remaining interval makes the change smooth.
inline constexpr double kCopyAlone = 0.4, kCopyApart = 1.6;

// A quick look: the balls of nodes lie within kPokeOut root radii of the root's middle, because
// each contains spheres of the root's ball and is itself no larger, or little. A solid smaller than
// kSpeck of the other overlaps by nothing.
inline constexpr double kPokeOut = 3;
inline constexpr double kSpeck = 1e-9;
/// Least distance of two centres: equal balls in one place then overlap by all of their volume.
inline constexpr double kLeastDistance = 1e-18;

}  // namespace ist
