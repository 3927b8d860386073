#pragma once

#include "packing/banded/sample.h"

namespace ist::packing {

/// Result of maximise_clearance().
struct ClearanceOptimum {
  float value = 0;  ///< ≥ max over the box of min over the constraints, whatever the rounding
  Float3 y;         ///< the maximum of the linear model, inside the box
};

constexpr int kMostPivots = 24;
constexpr float kTolerance = 1e-5f;   ///< of a violation, in half-edges of the box
constexpr float kLeastPivot = 1e-5f;  ///< a smaller element of the basis counts as 0

/// The bound that the multipliers prove. `sums`: of λ, λb, λ·gradient; z: the vertex (t, y).
IST_HD inline ClearanceOptimum optimum_of(float first_value, const float sums[5], const float z[4],
                                          float a) {
  ClearanceOptimum optimum;
  optimum.value = first_value;
  if (sums[0] > 0) {
    const float value =
        (sums[1] + a * (fabsf(sums[2]) + fabsf(sums[3]) + fabsf(sums[4]))) / sums[0];
    if (value < first_value) optimum.value = value;
  }
  const auto clamp = [a](float y) { return y > a ? a : (y < -a ? -a : y); };
  optimum.y = {clamp(z[1]), clamp(z[2]), clamp(z[3])};
  return optimum;
}

/// maximise_clearance() by a team of at least 32 lanes, with the same arithmetic: each lane keeps a
/// row in registers, and lane 4 i + k of every 16 keeps element (i, k) of the basis' inverse and
/// the data of slot k (SimplexBasis). All lanes know the vertex z. Rows are numbered: constraints
/// from 0 on, side +y_k of the box −6 + 2 k, side −y_k one more; the first lanes have the sides.
template <class Team>
IST_HD_ONCE ClearanceOptimum maximise_by_lanes(const Team& team, const SampleMemory* sample,
                                               int count, float a, float h2) {
  constexpr int kSides = 6;
  static_assert(kSampleCapacity + kSides <= Team::kWidth);
  const SampleMemory& c = *team.memory(sample);

  // This lane's row: level + n·y − unit·t ≥ 0.
  const int own = team.lane() - kSides;
  const bool constraint = own >= 0 && own < count;
  const int at = constraint ? own : 0;
  float level = c.distance[at] + c.curvature[at] * h2;
  float n0 = c.gradient[0][at], n1 = c.gradient[1][at], n2 = c.gradient[2][at];
  const std::uint32_t tag =
      constraint ? c.tag[at] : 0xFFFFFFF0u + (team.lane() & 15);  // sides last
  float first_value = constraint ? level + a * (fabsf(n0) + fabsf(n1) + fabsf(n2)) : kFarAway;
  const int first = index_of_least(team, first_value, tag, at);
  const float unit = constraint ? 1.f : 0.f;
  if (!constraint) {
    const float side = own >= 0 ? 0.f : ((own & 1) != 0 ? 1.f : -1.f);
    const int axis = (own + kSides) >> 1;
    level = own < 0 ? a : kFarAway;
    n0 = axis == 0 ? side : 0;
    n1 = axis == 1 ? side : 0;
    n2 = axis == 2 ? side : 0;
  }

  // The basis: the constraint `first` against three sides.
  const int i = team.lane() >> 2 & 3, k = team.lane() & 3;
  const int before = i > 0 ? i - 1 : 0;
  const Float3 n = {c.gradient[0][first], c.gradient[1][first], c.gradient[2][first]};
  float z0 = first_value, z1 = n.x < 0 ? -a : a, z2 = n.y < 0 ? -a : a, z3 = n.z < 0 ? -a : a;
  const float mine = k == 1 ? n.x : (k == 2 ? n.y : n.z);
  const float sign = mine < 0 ? -1.f : 1.f;
  int row = k == 0 ? first : 2 * k - 8 + (mine < 0 ? 1 : 0);
  float lambda = k == 0 ? 1.f : fabsf(mine);
  float inverse = i == k ? (k == 0 ? 1.f : sign) : (i == 0 ? sign * mine : 0.f);

  const float tolerance = kTolerance * a;
  IST_ROLLED for (int pivot = 0; pivot < kMostPivots; ++pivot) {
    // Entering row: the most violated, then the smallest tag. Numbers ≥ 0 are ordered like their
    // bits.
    const float slack = level + n0 * z1 + n1 * z2 + n2 * z3 - unit * z0;
    const std::uint32_t beyond = slack < 0 ? bits_of(-slack) : 0;
    const std::uint32_t most = team.max(beyond);
    const float worst = float_of(most);
    if (!(worst > tolerance)) break;
    int holders = 0;
    int entering = team.first(beyond == most, holders);
    if (holders > 1) {
      const std::uint32_t least = team.min(beyond == most ? tag : 0xFFFFFFFFu);
      entering = team.first(beyond == most && tag == least, holders);
    }
    entering -= kSides;

    // Element i of the entering row, then of that row times the inverse.
    float r = 0;
    if (entering >= 0)
      r = i == 0 ? 1.f : -c.gradient[before][entering];
    else if (i == ((entering + kSides) >> 1) + 1)
      r = (entering & 1) != 0 ? -1.f : 1.f;
    float w = r * inverse;
    w = w + team.broadcast(w, team.lane() ^ 4);
    w = w + team.broadcast(w, team.lane() ^ 8);
    const bool may_leave = w > kLeastPivot;
    const float inverse_w = 1 / (may_leave ? w : 1);
    const float ratio = lambda * inverse_w + 0.f;  // no −0
    const std::uint32_t travel = may_leave && ratio < kFarAway ? bits_of(ratio) : 0xFFFFFFFFu;
    const std::uint32_t shortest = team.min(travel);
    if (shortest == 0xFFFFFFFFu) break;
    const int leaving = team.first(travel == shortest, holders);
    const float theta = float_of(shortest);
    const float column =
        team.broadcast(inverse, (team.lane() & ~3) | leaving) * team.broadcast(inverse_w, leaving);
    const bool leaves = k == leaving;
    inverse = leaves ? column : inverse - w * column;
    const float rest = lambda - theta * w;
    lambda = leaves ? theta : (rest < 0 ? 0 : rest);
    row = leaves ? entering : row;
    const float step = worst * column;
    z0 -= team.broadcast(step, 0);
    z1 -= team.broadcast(step, 4);
    z2 -= team.broadcast(step, 8);
    z3 -= team.broadcast(step, 12);
  }

  // Sums over the slots, in pairs: of λ, and of λb (i = 0) or λ·gradient (i − 1).
  const int of = row >= 0 ? row : 0;
  const float multiplier = row >= 0 ? lambda : 0;
  float product =
      multiplier * (i == 0 ? c.distance[of] + c.curvature[of] * h2 : c.gradient[before][of]);
  float total = multiplier + team.broadcast(multiplier, team.lane() ^ 1);
  total = total + team.broadcast(total, team.lane() ^ 2);
  product = product + team.broadcast(product, team.lane() ^ 1);
  product = product + team.broadcast(product, team.lane() ^ 2);
  const float sums[5] = {total, team.broadcast(product, 0), team.broadcast(product, 4),
                         team.broadcast(product, 8), team.broadcast(product, 12)};
  const float z[4] = {z0, z1, z2, z3};
  return optimum_of(first_value, sums, z, a);
}

/// The basis of the linear program in maximise_clearance(): four rows, constraints (≥ 0) or the
/// box's sides (−1 … −6: +x −x +y −y +z −z), one in each slot. z = (t, y) is the vertex where they
/// meet, column k of `inverse` belongs to slot k, `lambda` are multipliers. Sums are formed in
/// pairs, (0 + 1) + (2 + 3), so that lanes may share them (maximise_by_lanes).
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

  /// Adds the row `entering`, violated by `worst`, and drops one. False if none can leave.
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

/// Maximises min_i (distance_i + curvature_i·h2 + gradient_i·y) over the box |y_k| ≤ a. `count` ≥
/// 1. With h2 = 3a² the value bounds every clearance in the box (Constraint); with h2 = 0 it is the
/// linear model that the ascent follows.
///
/// A linear program in (t, y): max t, t − gradient_i·y ≤ b_i, ±y_k ≤ a. Dual simplex from the
/// tightest single constraint; every basis in between is dual feasible, so stopping early still
/// gives a bound. The value is computed at the end from the multipliers by weak duality, Σλ_i b_i +
/// a‖Σλ_i gradient_i‖₁ with Σλ_i = 1, which holds for any λ ≥ 0: rounding in the pivots can only
/// loosen it. Ties are broken by the smallest tag, so the result is a function of the set of
/// constraints. `sample`: its constraints.
template <class Team>
IST_HD ClearanceOptimum maximise_clearance(const Team& team, const SampleMemory* sample, int count,
                                           float a, float h2) {
  if constexpr (Team::kWidth >= 32) return maximise_by_lanes(team, sample, count, a, h2);
  const SampleMemory& constraints = *sample;
  const auto level = [&](int i) { return constraints.distance[i] + constraints.curvature[i] * h2; };
  const auto& g = constraints.gradient;

  int first = 0;
  float first_value = kFarAway;
  {
    std::uint32_t tag = 0xFFFFFFFFu;
    for (int i = team.lane(); i < count; i += Team::kWidth) {
      const float value = level(i) + a * (fabsf(g[0][i]) + fabsf(g[1][i]) + fabsf(g[2][i]));
      if (value < first_value || (value == first_value && constraints.tag[i] < tag)) {
        first = i;
        first_value = value;
        tag = constraints.tag[i];
      }
    }
    first = index_of_least(team, first_value, tag, first);
  }
  SimplexBasis basis;
  basis.begin(first, first_value, get(team, sample, first).gradient, a);

  const float tolerance = kTolerance * a;
  for (int pivot = 0; pivot < kMostPivots; ++pivot) {
    // Entering row: the most violated; the smallest tag among equals, constraints before sides.
    const float* z = basis.z;
    int entering = 0;
    float least = -tolerance;  // of the negated violations
    std::uint32_t tag = 0xFFFFFFFFu;
    for (int i = team.lane(); i < count; i += Team::kWidth) {
      const float slack = level(i) + g[0][i] * z[1] + g[1][i] * z[2] + g[2][i] * z[3] - z[0];
      if (slack < least || (slack == least && constraints.tag[i] < tag)) {
        least = slack;
        entering = i;
        tag = constraints.tag[i];
      }
    }
    entering = index_of_least(team, least, tag, entering);
    float worst = -least;
    bool violated = worst > tolerance;
    for (int k = 0; k < 3; ++k) {
      const float beyond = fabsf(z[k + 1]) - a;
      if (beyond > worst) {
        worst = beyond;
        entering = z[k + 1] < 0 ? -2 - 2 * k : -1 - 2 * k;
        violated = true;
      }
    }
    if (!violated || !basis.exchange(constraints, entering, worst)) break;
  }

  float sums[5];  // of λ, λb, λ·gradient
  basis.dual(constraints, level, sums);
  return optimum_of(first_value, sums, basis.z, a);
}

}  // namespace ist::packing
