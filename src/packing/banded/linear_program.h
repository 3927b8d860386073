#pragma once

#include "packing/banded/simplex_basis.h"

namespace ist::packing {

/// Maximises min_i (distance_i + curvature_i·h2 + gradient_i·y) over the box |y_k| ≤ a. `count`
/// ≥ 1. With h2 = 3a² the value bounds every clearance in the box (Constraint); with h2 = 0 it is
/// the linear model that the ascent follows.
///
/// A linear program in (t, y): max t, t − gradient_i·y ≤ b_i, ±y_k ≤ a. Dual simplex from the
/// constraint that alone is tightest; every basis on the way is dual feasible, so stopping early
/// still gives a bound. The value is formed at the end from the multipliers by weak duality,
/// Σλ_i b_i + a‖Σλ_i gradient_i‖₁ with Σλ_i = 1, which holds for any λ ≥ 0: rounding in the pivots
/// can only loosen it. Ties go to the smallest tag, so the result is a function of the set of
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
