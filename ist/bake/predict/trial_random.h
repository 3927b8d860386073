#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "base/hashing.h"

namespace ist {

inline constexpr double kHalfDecade = 3.1622776601683795;

/// Random numbers by + − × ÷ sqrt, so that poses are the same everywhere.
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

  /// Evenly spread over all rotations: a point of the ball in four dimensions, brought to length 1.
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

}  // namespace ist
