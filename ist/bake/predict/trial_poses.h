#pragma once

#include <ist/asset.h>
#include <ist/asset_layout.h>

#include "mesh/mesh_solid.h"

namespace ist {

/// Two solids that overlap, with the truth about it.
struct TrialPose {
  Pose b_in_a;  ///< x_A = R (scale_b · x_B) + t
  double scale_b = 1;
  double volume = 0;                ///< [u³] of the overlap
  double fraction = 0;              ///< of the smaller solid's volume
  std::uint32_t overlap_class = 0;  ///< [0, kOverlapClasses)
};

/// Names of the classes of overlap, as reports and `ist info` print them.
inline constexpr std::array<const char*, kOverlapClasses> kOverlapClassNames = {
    "contained", "10–50 %", "1–10 %", "0.1–1 %", "0.01–0.1 %"};

/// A solid, and an asset that contains its own triangles.
struct TrialBody {
  const MeshSolid& solid;
  AssetView mesh;
};

/// About `per_class` poses for each class of overlap: independent random rotations, directions of
/// approach and overlaps, spread evenly over their logarithm (over 10–50 % over themselves);
/// `contained` ones contain a smaller B whole. Volumes are exact. Same poses for the same seed, on
/// any machine. `go_on(part)`, if any, is told every few milliseconds which part of [0, 1] is done;
/// once it says no, the poses so far are all.
std::vector<TrialPose> trial_poses(const TrialBody& a, const TrialBody& b, std::uint32_t per_class,
                                   std::uint64_t seed,
                                   const std::function<bool(double)>& go_on = {});

/// Likewise about `count` poses within half a decade of one overlap in [1e-4, 0.5].
std::vector<TrialPose> trial_poses_near(double overlap, const TrialBody& a, const TrialBody& b,
                                        std::uint32_t count, std::uint64_t seed,
                                        const std::function<bool(double)>& go_on = {});

/// Whether a pose's overlap lies within half a decade of another.
bool is_near(const TrialPose& pose, double overlap);

}  // namespace ist
