#pragma once

#include "cuda/query/lens_sums.h"
#include "cuda/query/pair_place.h"
#include "cuda/query/part_sums.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// Sums in world units, as Penetration has them.
struct WorldSums {
  double volume;
  double centre[3];  ///< zero if there is no volume
  double push[3];    ///< dV/d(translation of B)
  double turn[3];    ///< dV/d(rotation vector of B), about B's origin

  /// As world_answer() (query/descent/answer.h).
  IST_HD static WorldSums of(const PairPlace& place, const double (&t)[kTerms]) {
    const double unit = place.unit_a, unit3 = unit * unit * unit;
    WorldSums sums = {};
    sums.volume = unit3 * (kPi / 3) * t[kCaps];
    double turn[3];
    for (int row = 0; row < 3; ++row) {
      const double* const r = place.rotation_a + 3 * row;
      sums.push[row] =
          -2 * kPi * unit * unit * (r[0] * t[kForce] + r[1] * t[kForce + 1] + r[2] * t[kForce + 2]);
      turn[row] =
          -2 * kPi * unit3 * (r[0] * t[kTorque] + r[1] * t[kTorque + 1] + r[2] * t[kTorque + 2]);
      if (!(t[kCaps] > 0)) continue;
      double moment = 0;
      for (int k = 0; k < 3; ++k)
        moment += r[k] * (t[kMoment + k] / t[kCaps] + place.a_from_b.t[k]);
      sums.centre[row] = place.origin_a[row] + unit * moment;
    }
    const double* const o = place.offset_b;
    const double(&push)[3] = sums.push;
    sums.turn[0] = turn[0] + (o[1] * push[2] - o[2] * push[1]);
    sums.turn[1] = turn[1] + (o[2] * push[0] - o[0] * push[2]);
    sums.turn[2] = turn[2] + (o[0] * push[1] - o[1] * push[0]);
    return sums;
  }

  /// By a motion of A, about its origin. `arm`: [u] from A's origin to B's (turn_over(),
  /// query/base/turned_over.h).
  IST_HD void turn_over(const double (&arm)[3]) {
    turn[0] = -(turn[0] + (arm[1] * push[2] - arm[2] * push[1]));
    turn[1] = -(turn[1] + (arm[2] * push[0] - arm[0] * push[2]));
    turn[2] = -(turn[2] + (arm[0] * push[1] - arm[1] * push[0]));
    for (double& p : push) p = -p;
  }
};

}  // namespace ist::gpu
