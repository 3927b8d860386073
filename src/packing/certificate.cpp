#include "packing/certificate.h"

#include <algorithm>
#include <cmath>

namespace ist::packing {

float rounded_down(double x) {
  const auto nearest = static_cast<float>(x);
  return double{nearest} > x ? std::nextafter(nearest, -1.0f) : nearest;
}

float certified_radius(Float3 centre, float radius, double surface_distance,
                       const std::vector<Sphere>& spheres, const SphereGrid& grid) {
  // The square root and the sum round by some 2⁻⁵³ of their size (≤ 4): 1e-14 covers that.
  constexpr double kGap = kClearance + 1e-14;
  double r = std::min(double{radius}, surface_distance - kGap);
  grid.for_near(centre, [&](std::uint32_t i) {
    const Sphere& s = spheres[i];
    const double x = double{centre.x} - double{s.x};
    const double y = double{centre.y} - double{s.y};
    const double z = double{centre.z} - double{s.z};
    r = std::min(r, std::sqrt(x * x + y * y + z * z) - double{s.r} - kGap);
  });
  return rounded_down(r);
}

}  // namespace ist::packing
