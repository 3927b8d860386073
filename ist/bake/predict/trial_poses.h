#pragma once

#include <ist/asset.h>
#include <ist/asset_layout.h>
#include <Eigen/Geometry>
#include <cmath>

#include "base/hashing.h"
#include "mesh/mesh_solid.h"

namespace ist {

inline constexpr double kHalfDecade = 3.1622776601683795;

/// Random numbers by + − × ÷ sqrt, so that poses are the same on every platform.
class TrialRandom {
 public:
  explicit TrialRandom(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() { return mixed(state_ += 0x9E3779B97F4A7C15ull); }
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }  ///< [0, 1)
  double symmetric() { return 2 * uniform() - 1; }

  Eigen::Vector3d direction() {
    for (;;) {
      const Eigen::Vector3d v(symmetric(), symmetric(), symmetric());
      const double squared = v.squaredNorm();
      if (squared <= 1 && squared > 1e-4) return v / std::sqrt(squared);
    }
  }

  /// Uniform over all rotations: a point of the four-dimensional ball, normalised.
  Eigen::Quaterniond rotation() {
    for (;;) {
      const double q[4] = {symmetric(), symmetric(), symmetric(), symmetric()};
      const double squared = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
      if (squared > 1 || squared < 1e-4) continue;
      const double norm = std::sqrt(squared);
      return {q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm};
    }
  }

 private:
  std::uint64_t state_;
};

/// Somewhere in [floor, 10 floor), evenly on the logarithm.
inline double random_in_decade(double floor, TrialRandom& random) {
  constexpr std::uint64_t kSteps = 100;         // of a decade
  constexpr double kStep = 1.0232929922807541;  // 10^(1/100)
  const std::uint64_t steps = random.bits() % kSteps;
  for (std::uint64_t step = 0; step < steps; ++step) floor *= kStep;
  return floor;
}

/// Two solids that overlap, with the exact volume.
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
/// approach and overlaps, uniform in their logarithm (over 10–50 % uniform in themselves). In
/// `contained` ones A contains a smaller B. Volumes are exact. Same poses for the same seed, on any
/// machine. `go_on(part)`, if any, is called every few milliseconds with the finished part of [0,
/// 1]; if it returns false, the poses so far are returned.
std::vector<TrialPose> trial_poses(const TrialBody& a, const TrialBody& b, std::uint32_t per_class,
                                   std::uint64_t seed,
                                   const std::function<bool(double)>& go_on = {});

/// Likewise about `count` poses within half a decade of one overlap in [1e-4, 0.5].
std::vector<TrialPose> trial_poses_near(double overlap, const TrialBody& a, const TrialBody& b,
                                        std::uint32_t count, std::uint64_t seed,
                                        const std::function<bool(double)>& go_on = {});

/// True if a pose's overlap is within half a decade of another.
bool is_near(const TrialPose& pose, double overlap);

}  // namespace ist
