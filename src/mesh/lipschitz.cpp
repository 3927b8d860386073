#include "mesh/lipschitz.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <ist/error.h>

#include "mesh/message_text.h"

namespace ist {
namespace {

constexpr std::uint64_t kPairs = 20'000;
constexpr double kRounding = 1e-9;  ///< of the coordinates: no double-precision field is worse

/// A number in [0, 1) for every index: SplitMix64.
double random_at(std::uint64_t index) {
  std::uint64_t z = (index + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
}

}  // namespace

void require_lipschitz(const Solid& solid) {
  const UnitFrame frame = unit_frame(solid.bounds());
  const Eigen::Vector3d half = solid.bounds().sizes() / 2;
  const double far = frame.centre.cwiseAbs().maxCoeff() + half.maxCoeff();
  struct Finding {
    double steepness = 0;  ///< change over distance
    bool not_finite = false;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  std::vector<Finding> findings(kPairs);
  tbb::parallel_for(std::uint64_t{0}, kPairs, [&](std::uint64_t i) {
    // Distances from the whole box down to a 4096th of it.
    const double reach = std::ldexp(half.maxCoeff(), -static_cast<int>(i % 13));
    Eigen::Vector3d p, q;
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t at = 6 * i + static_cast<std::uint64_t>(k);
      p[k] = frame.centre[k] + 1.1 * half[k] * (2 * random_at(at) - 1);
      q[k] = p[k] + reach * (2 * random_at(at + 3) - 1);
    }
    const double a = solid.signed_distance(p), b = solid.signed_distance(q);
    const Eigen::Vector3d way = q - p;
    const double apart = std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    Finding& found = findings[i];
    found.place = p;
    found.not_finite = !std::isfinite(a) || !std::isfinite(b);
    if (!found.not_finite && std::abs(a - b) > apart + kRounding * far)
      found.steepness = std::abs(a - b) / apart;
  });
  const Finding* worst = &findings[0];
  for (const Finding& one : findings) {
    if (one.not_finite)
      throw Error("solid: its signed distance is not finite near " + position_text(one.place));
    if (one.steepness > worst->steepness) worst = &one;
  }
  if (worst->steepness > 0)
    throw Error("solid: its signed distance is not 1-Lipschitz: its slope is " +
                shortest(worst->steepness) + " near " + position_text(worst->place) +
                ". Divide it by its largest slope");
}

}  // namespace ist
