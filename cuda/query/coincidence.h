#pragma once

#include <cmath>

#include "cuda/query/pair_place.h"
#include "numerics/host_device.h"
#include "query/asset/shared_constants.h"
#include "query/base/smooth_step.h"

namespace ist::gpu {

/// How a number grows with motions of B, A's unit frame.
struct PairSlope {
  double by_translation[3], by_rotation[3];
};

/// How nearly two copies of one tree coincide: coincidence_weight() (query/detail/coincident.h) in
/// plain numbers.
struct Coincidence {
  double weight;  ///< [0, 1] part of the unlike levels
  PairSlope slope;

  /// `root`, `mean_radius`: of the tree.
  IST_HD Coincidence(const double (&root)[4], double mean_radius, const PairMap& a_from_b)
      : weight(0), slope{} {
    const double(&m)[9] = a_from_b.m;
    const double centre[3] = {root[0], root[1], root[2]};
    double moved[3], way[3], lever[3], way2 = 0;
    a_from_b.apply(centre, moved);
    for (int k = 0; k < 3; ++k) {
      way[k] = moved[k] - centre[k];
      lever[k] = moved[k] - a_from_b.t[k];
      way2 += way[k] * way[k];
    }
    const double spread = root[3] * root[3] / 5, scale = a_from_b.scale;
    const double turned = 3 * (scale * scale + 1) - 2 * ((m[0] + m[4]) + m[8]);
    const double square = way2 + spread * (turned > 0 ? turned : 0);
    if (!(square < (kCopyApart * kCopyApart) * (mean_radius * mean_radius))) return;
    const double distance = std::sqrt(square);
    const double t = (kCopyApart - distance / mean_radius) / (kCopyApart - kCopyAlone);
    weight = 1;
    if (t >= 1) return;
    weight = smooth_step(t);
    const double per = -6 * t * (1 - t) / ((kCopyApart - kCopyAlone) * mean_radius) / distance;
    const double axis[3] = {m[5] - m[7], m[6] - m[2], m[1] - m[3]};
    for (int k = 0; k < 3; ++k) {
      const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      slope.by_translation[k] = per * way[k];
      slope.by_rotation[k] = per * ((lever[k1] * way[k2] - lever[k2] * way[k1]) - spread * axis[k]);
    }
  }
};

}  // namespace ist::gpu
