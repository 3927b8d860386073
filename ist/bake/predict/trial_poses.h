#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <ist/pose.h>
#include <ist/tree_view.h>

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

/// A solid with an asset of it, by which poses are found; the truth comes from the solid alone.
struct TrialBody {
  const MeshSolid& solid;
  TreeView tree;
};

/// About `per_class` poses for each class of overlap: independent random rotations, directions of
/// approach and overlaps, spread evenly over their logarithm (over 10–50 % over themselves);
/// `contained` ones hold a smaller B whole. Volumes are integrated over the meshes to
/// `relative_error`; a pose for which that cannot be done is left out. Same poses for the same
/// seed, on any machine and for any number of threads. Runs on the caller's TBB threads.
/// `go_on(part)`, if any, is told every few milliseconds which part of [0, 1] is done; once it says
/// no, the poses so far are all.
std::vector<TrialPose> trial_poses(const TrialBody& a, const TrialBody& b, std::uint32_t per_class,
                                   double relative_error, std::uint64_t seed,
                                   const std::function<bool(double)>& go_on = {});

/// Likewise about `count` poses within half a decade of one overlap in [1e-4, 0.5].
std::vector<TrialPose> trial_poses_near(double overlap, const TrialBody& a, const TrialBody& b,
                                        std::uint32_t count, double relative_error,
                                        std::uint64_t seed,
                                        const std::function<bool(double)>& go_on = {});

/// Whether a pose's overlap lies within half a decade of another.
bool is_near(const TrialPose& pose, double overlap);

}  // namespace ist
