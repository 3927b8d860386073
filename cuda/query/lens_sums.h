#pragma once

#include <cmath>
#include <cstdint>

#include "numerics/host_device.h"

namespace ist::gpu {

/// What is summed over lenses, A's unit frame; positions from B's unit-frame origin.
enum Term {
  kCaps,        ///< 3/π · volume
  kForce,       ///< three: −1/2π · dV/d(translation of B)
  kTorque = 4,  ///< three: likewise about B's unit-frame origin
  kMoment = 7,  ///< three: 3/π · ∫ x dV
  kError = 10,  ///< 1/2π · bound on what rounded distances change in V
  kTerms = 11
};

IST_HD inline float root(float x) { return sqrtf(x); }
IST_HD inline double root(double x) { return sqrt(x); }

/// Two balls that meet.
template <class Real>
struct alignas(4 * sizeof(Real)) LensSide {
  Real x, y, z, r;
};

/// Adds the lens of ball A at `lever` with radius lever.r and ball B at `apart` from it with radius
/// apart.r. `rounding`: by how much the distance may be off. The sums g, f and e are those of
/// lens() (query/kernel/lens.h) and as little to be re-associated.
template <class Real>
IST_HD void add_lens(const LensSide<Real>& lever, const LensSide<Real>& apart, Real rounding,
                     Real (&sum)[kTerms]) {
  constexpr Real kTiny = sizeof(Real) == 4 ? Real(1.1754944e-38) : Real(2.2250738585072014e-308);
  const Real d = root((apart.x * apart.x + apart.y * apart.y) + apart.z * apart.z);
  const bool a_is_larger = lever.r > apart.r;
  const Real a = a_is_larger ? lever.r : apart.r;
  const Real b = a_is_larger ? apart.r : lever.r;
  Real g = (a - d) + b;
  const Real f = a - b <= b ? d - (a - b) : (d - a) + b;
  const Real e = (a - b) + d;
  g = g > 0 ? g : Real(0);
  const bool holds = f <= 0 || d < kTiny;
  const Real inverse = Real(0.5) / (holds ? Real(1) : d);
  Real hb = (e * inverse) * g;
  hb = holds || hb > 2 * b ? 2 * b : hb;
  const Real ha = holds ? Real(0) : (f * inverse) * g;
  const Real large = (ha * ha) * (3 * a - ha);
  const Real small = (hb * hb) * (3 * b - hb);
  const Real circle = ha * (2 * a - ha);
  const Real of_b = a_is_larger ? small : large;
  const Real caps = large + small;
  const Real pull = circle * inverse;
  const Real fx = pull * apart.x, fy = pull * apart.y, fz = pull * apart.z;
  sum[kCaps] += caps;
  sum[kForce] += fx;
  sum[kForce + 1] += fy;
  sum[kForce + 2] += fz;
  sum[kTorque] += lever.y * fz - lever.z * fy;
  sum[kTorque + 1] += lever.z * fx - lever.x * fz;
  sum[kTorque + 2] += lever.x * fy - lever.y * fx;
  sum[kMoment] += caps * lever.x + of_b * apart.x;
  sum[kMoment + 1] += caps * lever.y + of_b * apart.y;
  sum[kMoment + 2] += caps * lever.z + of_b * apart.z;
  sum[kError] += (Real(0.5) * circle + b * rounding) * rounding;
}

/// Sums of a pair of trees or of a part of it.
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

}  // namespace ist::gpu
