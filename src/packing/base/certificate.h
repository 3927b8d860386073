#pragma once

#include <ist/types.h>
#include <cmath>
#include <cstdint>

#include "base/elementary.h"
#include "base/vec3.h"

namespace ist::packing {

/// The limits and the targets of a packing; unit frame.
struct PackingLimits {
  double volume = 0;           ///< of the solid
  double target_coverage = 1;  ///< of the volume
  double min_radius = 0;
  double epsilon = 0;             ///< 0 = automatic
  std::uint64_t max_spheres = 0;  ///< 0 = no limit
  std::uint64_t seed = 0;
  double length_unit = 1;  ///< [u] of one unit-frame unit, for progress reports
};

/// Gap of a certified sphere to the surface and to others, unit frame (docs/design.md 3.2).
constexpr double kClearance = 1e-12;
/// The same plus the rounding of the square root and the sum: some 2⁻⁵³ of their size (≤ 4).
constexpr double kGap = kClearance + 1e-14;

/// Below this radius spheres are still certified, but the greedy guarantee ends (docs/design.md
/// 4.2).
constexpr float kFloatNoise = 1e-4f;

/// The largest radius of a sphere about `centre` next to another sphere, before rounding.
IST_HD inline double gap_to_sphere(Float3 centre, const Sphere& s) {
  const double x = double{centre.x} - double{s.x};
  const double y = double{centre.y} - double{s.y};
  const double z = double{centre.z} - double{s.z};
  return std::sqrt(x * x + y * y + z * z) - double{s.r} - kGap;
}

/// The same next to the surface at the exact distance `clearance`, positive inside. Certifying a
/// candidate requires only distances below clearance_limit() of its radius.
IST_HD inline double gap_to_surface(double clearance) { return clearance - kGap; }
IST_HD inline double clearance_limit(float radius) { return 1.001 * double{radius}; }

/// Certified radius of a candidate: no more than its own radius and all its gaps; ≤ 0 if it does
/// not fit. `gap`: the least of those to the surface and to the winners of the same round that
/// outrank it, each taken with its candidate's radius. The grid's reach must be at least `radius`.
template <class Team, class Spheres>
IST_HD float certified_radius(const Team& team, Float3 centre, float radius, double gap,
                              const Spheres& spheres) {
  double r = double{radius} < gap ? double{radius} : gap;
  spheres.for_near(team, centre, [&](bool valid, std::uint32_t, const Sphere& s) {
    const double to_sphere = gap_to_sphere(centre, s);
    if (valid && to_sphere < r) r = to_sphere;
  });
  return rounded_down(team.min(r));
}

/// Volumes are summed as integers, so that sums do not depend on the order. Their unit
/// [unit-frame³] is a power of two, 2^60 to 2^61 of which make the solid's volume: a needle's
/// spheres count too.
inline double volume_unit_of(double solid_volume) {
  int exponent = 0;
  std::frexp(solid_volume, &exponent);
  return std::ldexp(1.0, exponent - 61);
}

IST_HD inline std::uint64_t fixed_ball_volume(float r, double volume_unit) {
  const double radius = r;
  return static_cast<std::uint64_t>(4.18879020478639098 * radius * radius * radius / volume_unit);
}

}  // namespace ist::packing
