#pragma once

#include "packing/constraint.h"

namespace ist::packing {

/// Result of maximise_clearance().
struct ClearanceOptimum {
  float value = 0;  ///< ≥ max over the box of min over the constraints, whatever the rounding
  Float3 y;         ///< where the linear model is greatest, inside the box
};

/// Maximises min_i (distance_i + curvature_i·h2 + gradient_i·y) over the box |y_k| ≤ a. `count`
/// ≥ 1. With h2 = 3a² the value bounds every clearance in the box (Constraint); with h2 = 0 it is
/// the linear model that the ascent follows.
///
/// A linear program in (t, y): max t, t − gradient_i·y ≤ b_i, ±y_k ≤ a. Dual simplex from the
/// constraint that alone is tightest; every basis on the way is dual feasible, so stopping early
/// still gives a bound. The value is formed at the end from the multipliers by weak duality,
/// Σλ_i b_i + a‖Σλ_i gradient_i‖₁ with Σλ_i = 1, which holds for any λ ≥ 0: rounding in the pivots
/// can only loosen it.
IST_HD inline ClearanceOptimum maximise_clearance(const Constraint* constraints, int count, float a,
                                                  float h2) {
  constexpr int kMaxPivots = 24;
  int first = 0;
  float first_value = 0;
  for (int i = 0; i < count; ++i) {
    const Constraint& c = constraints[i];
    const float value = c.distance + c.curvature * h2 + a * norm1(c.gradient);
    if (i == 0 || value < first_value) {
      first = i;
      first_value = value;
    }
  }

  // Basis slot k holds row `row[k]`: ≥ 0 a constraint, −1 … −6 the box sides +x −x +y −y +z −z.
  // z = (t, y) is the vertex, column k of `inverse` answers to slot k, `lambda` are multipliers.
  const Float3 n = constraints[first].gradient;
  const float sx = n.x < 0 ? -1.f : 1.f, sy = n.y < 0 ? -1.f : 1.f, sz = n.z < 0 ? -1.f : 1.f;
  int row[4] = {first, n.x < 0 ? -2 : -1, n.y < 0 ? -4 : -3, n.z < 0 ? -6 : -5};
  float z[4] = {first_value, a * sx, a * sy, a * sz};
  float lambda[4] = {1, fabsf(n.x), fabsf(n.y), fabsf(n.z)};
  float inverse[4][4] = {
      {1, sx * n.x, sy * n.y, sz * n.z}, {0, sx, 0, 0}, {0, 0, sy, 0}, {0, 0, 0, sz}};

  const float tolerance = 1e-5f * a;
  for (int pivot = 0; pivot < kMaxPivots; ++pivot) {
    // Entering row: the most violated; the first among equals.
    int entering = -7;
    float worst = tolerance;
    for (int i = 0; i < count; ++i) {
      const Constraint& c = constraints[i];
      const float b = c.distance + c.curvature * h2;
      const float violation =
          z[0] - c.gradient.x * z[1] - c.gradient.y * z[2] - c.gradient.z * z[3] - b;
      if (violation > worst) {
        worst = violation;
        entering = i;
      }
    }
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
      const Float3 g = constraints[entering].gradient;
      r[0] = 1;
      r[1] = -g.x;
      r[2] = -g.y;
      r[3] = -g.z;
    } else {
      const int k = (-1 - entering) / 2;
      r[k + 1] = (-1 - entering) % 2 == 0 ? 1.f : -1.f;
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

    const float scale = 1 / w[leaving];
    for (int i = 0; i < 4; ++i) {
      const float column = inverse[i][leaving] * scale;
      for (int k = 0; k < 4; ++k)
        if (k != leaving) inverse[i][k] -= w[k] * column;
      inverse[i][leaving] = column;
      z[i] -= worst * column;
    }
    for (int k = 0; k < 4; ++k)
      if (k != leaving) {
        lambda[k] -= theta * w[k];
        if (lambda[k] < 0) lambda[k] = 0;
      }
    lambda[leaving] = theta;
    row[leaving] = entering;
  }

  float sum = 0, b = 0;
  Float3 g;
  for (int k = 0; k < 4; ++k)
    if (row[k] >= 0) {
      const Constraint& c = constraints[row[k]];
      sum += lambda[k];
      b += lambda[k] * (c.distance + c.curvature * h2);
      g = g + lambda[k] * c.gradient;
    }
  ClearanceOptimum optimum;
  optimum.value = first_value;
  if (sum > 0) {
    const float value = (b + a * norm1(g)) / sum;
    if (value < first_value) optimum.value = value;
  }
  const float y[3] = {z[1], z[2], z[3]};
  float clamped[3];
  for (int k = 0; k < 3; ++k) clamped[k] = y[k] > a ? a : (y[k] < -a ? -a : y[k]);
  optimum.y = {clamped[0], clamped[1], clamped[2]};
  return optimum;
}

}  // namespace ist::packing
