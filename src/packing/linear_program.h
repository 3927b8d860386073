#pragma once

#include "packing/sample.h"

namespace ist::packing {

/// Result of maximise_clearance().
struct ClearanceOptimum {
  float value = 0;  ///< ≥ max over the box of min over the constraints, whatever the rounding
  Float3 y;         ///< where the linear model is greatest, inside the box
};

/// v[k] for a k that is not known when compiling, without an indexed array.
IST_HD inline float pick(const float v[4], int k) {
  return k == 0 ? v[0] : (k == 1 ? v[1] : (k == 2 ? v[2] : v[3]));
}

/// Maximises min_i (distance_i + curvature_i·h2 + gradient_i·y) over the box |y_k| ≤ a. `count`
/// ≥ 1. With h2 = 3a² the value bounds every clearance in the box (Constraint); with h2 = 0 it is
/// the linear model that the ascent follows.
///
/// A linear program in (t, y): max t, t − gradient_i·y ≤ b_i, ±y_k ≤ a. Dual simplex from the
/// constraint that alone is tightest; every basis on the way is dual feasible, so stopping early
/// still gives a bound. The value is formed at the end from the multipliers by weak duality,
/// Σλ_i b_i + a‖Σλ_i gradient_i‖₁ with Σλ_i = 1, which holds for any λ ≥ 0: rounding in the pivots
/// can only loosen it. Ties go to the smallest tag, so the result is a function of the set of
/// constraints. Lanes share the search for the entering row; each does the pivot for itself.
template <class Team>
IST_HD_ONCE ClearanceOptimum maximise_clearance(const Team& team, const SampleMemory& constraints,
                                                int count, float a, float h2) {
  constexpr int kMaxPivots = 24;
  const auto level = [&](int i) { return constraints.distance[i] + constraints.curvature[i] * h2; };

  int first = 0;
  float first_value = kFarAway;
  {
    std::uint32_t tag = 0xFFFFFFFFu;
    IST_ROLLED for (int i = team.lane(); i < count; i += Team::kWidth) {
      const float value = level(i) + a * (fabsf(constraints.x[i]) + fabsf(constraints.y[i]) +
                                          fabsf(constraints.z[i]));
      if (value < first_value || (value == first_value && constraints.tag[i] < tag)) {
        first = i;
        first_value = value;
        tag = constraints.tag[i];
      }
    }
    first = index_of_least(team, first_value, tag, first);
  }

  // Basis slot k holds row `row[k]`: ≥ 0 a constraint, −1 … −6 the box sides +x −x +y −y +z −z.
  // z = (t, y) is the vertex, column k of `inverse` answers to slot k, `lambda` are multipliers.
  const Float3 n{constraints.x[first], constraints.y[first], constraints.z[first]};
  const float sx = n.x < 0 ? -1.f : 1.f, sy = n.y < 0 ? -1.f : 1.f, sz = n.z < 0 ? -1.f : 1.f;
  int row[4] = {first, n.x < 0 ? -2 : -1, n.y < 0 ? -4 : -3, n.z < 0 ? -6 : -5};
  float z[4] = {first_value, a * sx, a * sy, a * sz};
  float lambda[4] = {1, fabsf(n.x), fabsf(n.y), fabsf(n.z)};
  float inverse[4][4] = {
      {1, sx * n.x, sy * n.y, sz * n.z}, {0, sx, 0, 0}, {0, 0, sy, 0}, {0, 0, 0, sz}};

  const float tolerance = 1e-5f * a;
  IST_ROLLED for (int pivot = 0; pivot < kMaxPivots; ++pivot) {
    // Entering row: the most violated; the smallest tag among equals, constraints before sides.
    int entering = -7;
    float worst = tolerance;
    std::uint32_t tag = 0xFFFFFFFFu;
    IST_ROLLED for (int i = team.lane(); i < count; i += Team::kWidth) {
      const float violation = z[0] - constraints.x[i] * z[1] - constraints.y[i] * z[2] -
                              constraints.z[i] * z[3] - level(i);
      if (violation > worst || (violation == worst && constraints.tag[i] < tag)) {
        worst = violation;
        entering = i;
        tag = constraints.tag[i];
      }
    }
    if constexpr (Team::kWidth > 1) {
      float least = -worst;
      const int index = index_of_least(team, least, tag, entering);
      worst = -least;
      entering = worst > tolerance ? index : -7;
    }
    if (!(worst > tolerance)) entering = -7;
    for (int k = 0; k < 3; ++k) {
      if (z[k + 1] - a > worst) {
        worst = z[k + 1] - a;
        entering = -1 - 2 * k;
      }
      if (-z[k + 1] - a > worst) {
        worst = -z[k + 1] - a;
        entering = -2 - 2 * k;
      }
    }
    if (entering == -7) break;

    float r[4] = {0, 0, 0, 0};
    if (entering >= 0) {
      r[0] = 1;
      r[1] = -constraints.x[entering];
      r[2] = -constraints.y[entering];
      r[3] = -constraints.z[entering];
    } else {
      const float side = (-1 - entering) % 2 == 0 ? 1.f : -1.f;
      const int axis = (-1 - entering) / 2;
      for (int k = 0; k < 3; ++k) r[k + 1] = k == axis ? side : 0.f;
    }
    float w[4];
    for (int k = 0; k < 4; ++k)
      w[k] =
          r[0] * inverse[0][k] + r[1] * inverse[1][k] + r[2] * inverse[2][k] + r[3] * inverse[3][k];
    int leaving = -1;
    float theta = 0;
    for (int k = 0; k < 4; ++k)
      if (w[k] > 1e-5f) {
        const float ratio = lambda[k] / w[k];
        if (leaving < 0 || ratio < theta) {
          leaving = k;
          theta = ratio;
        }
      }
    if (leaving < 0) break;

    const float scale = 1 / pick(w, leaving);
    for (int i = 0; i < 4; ++i) {
      const float column = pick(inverse[i], leaving) * scale;
      for (int k = 0; k < 4; ++k)
        inverse[i][k] = k == leaving ? column : inverse[i][k] - w[k] * column;
      z[i] -= worst * column;
    }
    for (int k = 0; k < 4; ++k) {
      const float rest = lambda[k] - theta * w[k];
      lambda[k] = k == leaving ? theta : (rest < 0 ? 0 : rest);
      row[k] = k == leaving ? entering : row[k];
    }
  }

  float sum = 0, b = 0;
  Float3 g;
  for (int k = 0; k < 4; ++k)
    if (row[k] >= 0) {
      sum += lambda[k];
      b += lambda[k] * level(row[k]);
      g = g +
          lambda[k] * Float3{constraints.x[row[k]], constraints.y[row[k]], constraints.z[row[k]]};
    }
  ClearanceOptimum optimum;
  optimum.value = first_value;
  if (sum > 0) {
    const float value = (b + a * norm1(g)) / sum;
    if (value < first_value) optimum.value = value;
  }
  const auto clamp = [a](float y) { return y > a ? a : (y < -a ? -a : y); };
  optimum.y = {clamp(z[1]), clamp(z[2]), clamp(z[3])};
  return optimum;
}

}  // namespace ist::packing
