#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/host_device.h"
#include "base/vec3.h"
#include "cuda/query/tree_ref.h"
#include "query/base/pair_place.h"

namespace ist::gpu {

// Sums over the spheres below each node of a tree, so that a node that is wholly inside a field
// takes one step.

/// The sums over the spheres below a node, their tree's unit frame.
struct NodeSum {
  double cubes;      ///< Σ r³
  double moment[3];  ///< Σ r³ · centre
};

/// The sums of a tree, in place.
struct SumsRef {
  const NodeSum* level[kMaxLevels];  ///< [nodes of the level]
  std::uint32_t sphere_count;

  /// `sums`: those of node_sums().
  static SumsRef of(const TreeHeader& tree, const NodeSum* sums) {
    SumsRef ref = {};
    ref.sphere_count = tree.sphere_count;
    for (std::uint32_t k = 0; k < tree.level_count; ++k) {
      ref.level[k] = sums;
      sums += tree.level[k].count;
    }
    return ref;
  }

  IST_HD std::uint32_t spheres_below(int at_level, std::uint32_t node) const {
    const std::uint64_t full = std::uint64_t{kWidth} << (4 * at_level);
    const std::uint64_t begin = full * node, end = begin + full;
    return static_cast<std::uint32_t>((end < sphere_count ? end : sphere_count) - begin);
  }
};

constexpr double kPi = std::numbers::pi;

/// The sums over lenses, A's unit frame. Positions are relative to the origin of B's unit frame.
enum Term {
  kCaps,        ///< 3/π · volume
  kForce,       ///< three: −1/2π · dV/d(translation of B)
  kTorque = 4,  ///< three: likewise about B's unit-frame origin
  kMoment = 7,  ///< three: 3/π · ∫ x dV
  kTerms = 10
};

struct LensBall {
  double at[3], r;
};

/// Adds the lens of ball A at `lever` and ball B at `apart` from it, lengths times `unit`; false if
/// they do not intersect. Centres within `blur`, their rounding, count as equal, so that equal
/// balls do not push, as on the CPU.
///
/// Terms that cancel are computed in double as products of sums: the depth of the overlap, and how
/// far the smaller ball extends beyond the larger. The rest, lens() of query/kernel/lens.h, then
/// keeps its digits in float, even if balls graze.
IST_HD inline bool add_lens(const LensBall& lever, const LensBall& apart, double unit, double blur,
                            float (&sum)[kTerms]) {
  const double d2 = std::fma(apart.at[0], apart.at[0],
                             std::fma(apart.at[1], apart.at[1], apart.at[2] * apart.at[2]));
  const double reach = lever.r + apart.r, rest = lever.r - apart.r;
  const double into = std::fma(reach, reach, -d2);  // (reach − d)(reach + d)
  if (!(into > 0)) return false;
  const double out = std::fma(-rest, rest, d2);  // (d − |rest|)(d + |rest|)
  const double unit2 = unit * unit;
  const bool a_is_larger = rest > 0;
  const auto a = static_cast<float>((a_is_larger ? lever.r : apart.r) * unit);
  const auto b = static_cast<float>((a_is_larger ? apart.r : lever.r) * unit);
  const float d = std::sqrt(static_cast<float>(d2 * unit2));
  const bool holds = out <= 0 || d2 <= blur * blur;
  const float e = holds ? 1.0f : static_cast<float>((a_is_larger ? rest : -rest) * unit) + d;
  const float inverse = 0.5f / (holds ? 1.0f : d);
  const float g = static_cast<float>(into * unit2) / ((a + b) + d) * inverse;
  const float f = static_cast<float>(out * unit2) / e;
  const float ha = holds ? 0.0f : f * g;
  float hb = e * g;
  hb = holds || hb > 2 * b ? 2 * b : hb;
  const float large = (ha * ha) * (3 * a - ha);
  const float small = (hb * hb) * (3 * b - hb);
  const float circle = ha * (2 * a - ha);
  const float of_b = a_is_larger ? small : large;
  const float caps = large + small;
  const float pull = circle * inverse;
  const float x = static_cast<float>(apart.at[0] * unit),
              lx = static_cast<float>(lever.at[0] * unit);
  const float y = static_cast<float>(apart.at[1] * unit),
              ly = static_cast<float>(lever.at[1] * unit);
  const float z = static_cast<float>(apart.at[2] * unit),
              lz = static_cast<float>(lever.at[2] * unit);
  const float fx = pull * x, fy = pull * y, fz = pull * z;
  sum[kCaps] += caps;
  sum[kForce] += fx;
  sum[kForce + 1] += fy;
  sum[kForce + 2] += fz;
  sum[kTorque] += ly * fz - lz * fy;
  sum[kTorque + 1] += lz * fx - lx * fz;
  sum[kTorque + 2] += lx * fy - ly * fx;
  sum[kMoment] += caps * lx + of_b * x;
  sum[kMoment + 1] += caps * ly + of_b * y;
  sum[kMoment + 2] += caps * lz + of_b * z;
  return true;
}

/// Adds a ball that is inside another.
IST_HD inline void add_ball(const LensBall& ball, double unit, float (&sum)[kTerms]) {
  const double r = ball.r * unit;
  const double caps = 4 * (r * r * r);
  sum[kCaps] += static_cast<float>(caps);
  for (int k = 0; k < 3; ++k) sum[kMoment + k] += static_cast<float>(caps * (ball.at[k] * unit));
}

/// The power of `unit` in a term.
IST_HD constexpr int power_of(int term) {
  return term < kForce ? 3 : term < kTorque ? 2 : term < kMoment ? 3 : 4;
}

IST_HD inline double term_factor(double factor, int term) {
  double out = factor * factor;
  for (int p = power_of(term); p > 2; --p) out *= factor;
  return out;
}

/// The sums of a pair of trees, or of a part of it.
struct LensTotals {
  double term[kTerms];
  std::uint32_t spheres;  ///< lenses, and spheres that lie in one of the other side
  std::uint32_t visits;   ///< node pairs opened

  IST_HD void clear() {
    for (double& t : term) t = 0;
    spheres = visits = 0;
  }
  IST_HD void add(const LensTotals& other) {
    for (int k = 0; k < kTerms; ++k) term[k] += other.term[k];
    spheres += other.spheres;
    visits += other.visits;
  }
};

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
