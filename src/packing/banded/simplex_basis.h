#pragma once

#include "packing/banded/linear_program_by_lanes.h"

namespace ist::packing {

/// The basis of the linear program in maximise_clearance(): four rows, of constraints (≥ 0) and of
/// the box's sides (−1 … −6: +x −x +y −y +z −z), one in each slot. z = (t, y) is the vertex where
/// they meet, column k of `inverse` answers to slot k, `lambda` are multipliers. Sums go in pairs,
/// (0 + 1) + (2 + 3), so that lanes may share them (linear_program_by_lanes.h).
struct SimplexBasis {
  int row[4];
  float z[4], lambda[4], inverse[4][4];

  /// The constraint `first`, of gradient n, against three sides.
  IST_HD void begin(int first, float value, Float3 n, float a) {
    const float sx = n.x < 0 ? -1.f : 1.f, sy = n.y < 0 ? -1.f : 1.f, sz = n.z < 0 ? -1.f : 1.f;
    const SimplexBasis at = {
        {first, n.x < 0 ? -2 : -1, n.y < 0 ? -4 : -3, n.z < 0 ? -6 : -5},
        {value, a * sx, a * sy, a * sz},
        {1, fabsf(n.x), fabsf(n.y), fabsf(n.z)},
        {{1, sx * n.x, sy * n.y, sz * n.z}, {0, sx, 0, 0}, {0, 0, sy, 0}, {0, 0, 0, sz}}};
    *this = at;
  }

  /// Takes in the row `entering`, violated by `worst`, and drops the one that has to leave. False
  /// if none can.
  IST_HD bool exchange(const SampleMemory& constraints, int entering, float worst) {
    float r[4] = {0, 0, 0, 0};
    if (entering >= 0) {
      r[0] = 1;
      for (int i = 0; i < 3; ++i) r[i + 1] = -constraints.gradient[i][entering];
    } else {
      r[(-1 - entering) / 2 + 1] = (-1 - entering) % 2 == 0 ? 1.f : -1.f;
    }
    float w[4], inverse_w[4];
    int leaving = -1;
    float theta = kFarAway;
    for (int k = 0; k < 4; ++k) {
      w[k] = (r[0] * inverse[0][k] + r[1] * inverse[1][k]) +
             (r[2] * inverse[2][k] + r[3] * inverse[3][k]);
      inverse_w[k] = 1 / (w[k] > kLeastPivot ? w[k] : 1);
      const float ratio = lambda[k] * inverse_w[k] + 0.f;  // no −0
      if (w[k] > kLeastPivot && ratio < theta) {
        leaving = k;
        theta = ratio;
      }
    }
    if (leaving < 0) return false;
    const float scale = inverse_w[leaving];
    for (int i = 0; i < 4; ++i) {
      const float column = inverse[i][leaving] * scale;
      for (int k = 0; k < 4; ++k)
        inverse[i][k] = k == leaving ? column : inverse[i][k] - w[k] * column;
      z[i] -= worst * column;
    }
    for (int k = 0; k < 4; ++k) {
      const float rest = lambda[k] - theta * w[k];
      lambda[k] = k == leaving ? theta : (rest < 0 ? 0 : rest);
    }
    row[leaving] = entering;
    return true;
  }

  /// Sums of λ, λb, λ·gradient over the constraints of the basis.
  template <class Level>
  IST_HD void dual(const SampleMemory& constraints, const Level& level, float sums[5]) const {
    float term[4][5] = {};
    for (int k = 0; k < 4; ++k)
      if (row[k] >= 0) {
        term[k][0] = lambda[k];
        term[k][1] = lambda[k] * level(row[k]);
        for (int i = 0; i < 3; ++i) term[k][2 + i] = lambda[k] * constraints.gradient[i][row[k]];
      }
    for (int j = 0; j < 5; ++j) sums[j] = (term[0][j] + term[1][j]) + (term[2][j] + term[3][j]);
  }
};

}  // namespace ist::packing
