#pragma once

#include "packing/sample.h"

namespace ist::packing {

/// The basis of the linear program in maximise_clearance(): four rows, of constraints (≥ 0) and of
/// the box's sides (−1 … −6: +x −x +y −y +z −z), one in each slot. z = (t, y) is the vertex where
/// they meet, column k of `inverse` answers to slot k, `lambda` are multipliers. Sums go in pairs,
/// (0 + 1) + (2 + 3), so that lanes may share them.
///
/// A thread alone holds it all.
template <class Team, bool kShared = (Team::kWidth >= 16)>
struct SimplexBasis {
  int row[4];
  float z[4], lambda[4], inverse[4][4];

  /// The constraint `first`, of gradient n, against three sides.
  IST_HD void begin(const Team&, int first, float value, Float3 n, float a) {
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
  IST_HD bool exchange(const Team&, const SampleMemory& constraints, int entering, float worst) {
    float r[4] = {0, 0, 0, 0};
    if (entering >= 0) {
      r[0] = 1;
      for (int i = 0; i < 3; ++i) r[i + 1] = -constraints.gradient[i][entering];
    } else {
      r[(-1 - entering) / 2 + 1] = (-1 - entering) % 2 == 0 ? 1.f : -1.f;
    }
    float w[4];
    int leaving = -1;
    float theta = kFarAway;
    for (int k = 0; k < 4; ++k) {
      w[k] = (r[0] * inverse[0][k] + r[1] * inverse[1][k]) +
             (r[2] * inverse[2][k] + r[3] * inverse[3][k]);
      const float ratio = lambda[k] / w[k] + 0.f;  // no −0
      if (w[k] > 1e-5f && ratio < theta) {
        leaving = k;
        theta = ratio;
      }
    }
    if (leaving < 0) return false;
    const float scale = 1 / w[leaving];
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
  IST_HD void dual(const Team&, const SampleMemory& constraints, const Level& level,
                   float sums[5]) const {
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

/// Lane 4 i + k of every 16 holds element (i, k) of the inverse and what belongs to slot k; all
/// know the vertex.
template <class Team>
struct SimplexBasis<Team, true> {
  int i, k;
  int row;
  float z[4], lambda, inverse;

  IST_HD void begin(const Team& team, int first, float value, Float3 n, float a) {
    i = team.lane() >> 2 & 3;
    k = team.lane() & 3;
    const float sx = n.x < 0 ? -1.f : 1.f, sy = n.y < 0 ? -1.f : 1.f, sz = n.z < 0 ? -1.f : 1.f;
    z[0] = value;
    z[1] = a * sx;
    z[2] = a * sy;
    z[3] = a * sz;
    const float mine = k == 1 ? n.x : (k == 2 ? n.y : n.z);
    const float sign = mine < 0 ? -1.f : 1.f;
    row = k == 0 ? first : (mine < 0 ? -2 * k : 1 - 2 * k);
    lambda = k == 0 ? 1.f : fabsf(mine);
    inverse = i == k ? (k == 0 ? 1.f : sign) : (i == 0 ? sign * mine : 0.f);
  }

  IST_HD bool exchange(const Team& team, const SampleMemory& constraints, int entering,
                       float worst) {
    float r = 0;
    if (entering >= 0) {
      r = 1;
      if (i > 0) r = -constraints.gradient[i - 1][entering];
    } else if (i == (-1 - entering) / 2 + 1) {
      r = (-1 - entering) % 2 == 0 ? 1.f : -1.f;
    }
    float w = r * inverse;
    w = w + team.broadcast(w, team.lane() ^ 4);
    w = w + team.broadcast(w, team.lane() ^ 8);
    const float ratio = lambda / w + 0.f;  // no −0
    const float inverse_w = 1 / w;
    // Not negative: its bits order as it does.
    const std::uint32_t mine = w > 1e-5f && ratio < kFarAway ? bits_of(ratio) : 0xFFFFFFFFu;
    const std::uint32_t least = team.min(mine);
    if (least == 0xFFFFFFFFu) return false;
    int holders = 0;
    const int leaving = team.first(mine == least, holders);
    const float theta = float_of(least);
    const float column =
        team.broadcast(inverse, (team.lane() & ~3) | leaving) * team.broadcast(inverse_w, leaving);
    inverse = k == leaving ? column : inverse - w * column;
    const float rest = lambda - theta * w;
    lambda = k == leaving ? theta : (rest < 0 ? 0 : rest);
    row = k == leaving ? entering : row;
    const float step = worst * column;
    for (int j = 0; j < 4; ++j) z[j] -= team.broadcast(step, 4 * j);
    return true;
  }

  template <class Level>
  IST_HD void dual(const Team& team, const SampleMemory& constraints, const Level& level,
                   float sums[5]) const {
    for (int j = 0; j < 5; ++j) sums[j] = 0;
    if (row >= 0) {
      sums[0] = lambda;
      sums[1] = lambda * level(row);
      for (int j = 0; j < 3; ++j) sums[2 + j] = lambda * constraints.gradient[j][row];
    }
    for (int j = 0; j < 5; ++j) {
      sums[j] = sums[j] + team.broadcast(sums[j], team.lane() ^ 1);
      sums[j] = sums[j] + team.broadcast(sums[j], team.lane() ^ 2);
    }
  }
};

}  // namespace ist::packing
