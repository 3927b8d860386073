#pragma once

#include "packing/banded/sample.h"

namespace ist::packing {

/// Result of maximise_clearance().
struct ClearanceOptimum {
  float value = 0;  ///< ≥ max over the box of min over the constraints, whatever the rounding
  Float3 y;         ///< where the linear model is greatest, inside the box
};

constexpr int kMostPivots = 24;
constexpr float kTolerance = 1e-5f;   ///< of a violation, in half-edges of the box
constexpr float kLeastPivot = 1e-5f;  ///< below it an element of the basis counts as 0

/// What the multipliers prove: `sums` of λ, λb, λ·gradient; z the vertex (t, y).
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

/// maximise_clearance() by a team of at least 32 lanes, the same arithmetic: a row a lane, in
/// registers, and lane 4 i + k of every 16 holds element (i, k) of the basis' inverse and what
/// belongs to slot k (simplex_basis.h). All lanes know the vertex z. Rows are named by numbers:
/// constraints from 0 on, side +y_k of the box −6 + 2 k, side −y_k one more; the first lanes hold
/// the sides.
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
    // Entering row: the most violated; the smallest tag among equals. Numbers that are not negative
    // order as their bits do.
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
    const std::uint32_t way = may_leave && ratio < kFarAway ? bits_of(ratio) : 0xFFFFFFFFu;
    const std::uint32_t shortest = team.min(way);
    if (shortest == 0xFFFFFFFFu) break;
    const int leaving = team.first(way == shortest, holders);
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

}  // namespace ist::packing
