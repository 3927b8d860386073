#pragma once

#include <cstdint>

#include "base/plain.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/node_sums.h"
#include "query/base/pair_place.h"

namespace ist::gpu {

/// The sums of one lane over the parts of balls inside a field, field's frame. Positions are
/// relative to the origin of the tree's unit frame.
struct PartSums {
  double volume = 0;
  double force[3] = {0, 0, 0};   ///< d(volume)/d(translation of the tree)
  double torque[3] = {0, 0, 0};  ///< likewise about its unit-frame origin
  double moment[3] = {0, 0, 0};  ///< ∫ x dV
  std::uint32_t spheres = 0;
  std::uint32_t visits = 0;  ///< the team's

  /// Adds the part of a ball with centre x. `push`: its gradient by x. `shift`: its moment about x.
  IST_HD void add(const double (&x)[3], double part, const double (&push)[3],
                  const double (&shift)[3]) {
    volume += part;
    for (int k = 0; k < 3; ++k) {
      force[k] += push[k];
      moment[k] += part * x[k] + shift[k];
    }
    torque[0] += x[1] * push[2] - x[2] * push[1];
    torque[1] += x[2] * push[0] - x[0] * push[2];
    torque[2] += x[0] * push[1] - x[1] * push[0];
  }

  /// Adds a node that is inside as a whole.
  IST_HD void add_whole(const NodeSum& sum, std::uint32_t count, const Similarity& a_from_b) {
    const double factor = kBallVolume * (a_from_b.scale * a_from_b.scale * a_from_b.scale);
    volume += factor * sum.cubes;
    for (int k = 0; k < 3; ++k)
      moment[k] +=
          factor * ((a_from_b.m[3 * k] * sum.moment[0] + a_from_b.m[3 * k + 1] * sum.moment[1]) +
                    a_from_b.m[3 * k + 2] * sum.moment[2]);
    spheres += count;
  }

  /// The sums of the team in the form of an answer.
  template <class Team>
  IST_HD LensTotals total(const Team& team) const {
    LensTotals totals;
    totals.clear();
    totals.term[kCaps] = 3 / kPi * team.sum(volume);
    for (int k = 0; k < 3; ++k) {
      totals.term[kForce + k] = -1 / (2 * kPi) * team.sum(force[k]);
      totals.term[kTorque + k] = -1 / (2 * kPi) * team.sum(torque[k]);
      totals.term[kMoment + k] = 3 / kPi * team.sum(moment[k]);
    }
    totals.spheres = static_cast<std::uint32_t>(team.sum(static_cast<int>(spheres)));
    totals.visits = visits;
    return totals;
  }
};

}  // namespace ist::gpu
