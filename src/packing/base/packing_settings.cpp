#include "packing/base/packing_settings.h"

#include <ist/types.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace ist::packing {
namespace {

void require(bool in_range, const char* name, double value, const char* range) {
  if (in_range) return;
  std::ostringstream message;
  message << "packing: " << name << " is " << value << ", must be " << range;
  throw Error(message.str());
}

}  // namespace

void check_settings(const PackingSettings& s) {
  require(s.max_spheres <= std::numeric_limits<std::uint32_t>::max() / 2, "max_spheres",
          static_cast<double>(s.max_spheres), "below 2^31 (0 = no limit)");
  require(s.target_coverage >= 0 && s.target_coverage <= 1, "target_coverage", s.target_coverage,
          "in [0, 1]");
  require(s.min_radius >= 0 && std::isfinite(s.min_radius), "min_radius", s.min_radius,
          "finite and not negative");
  require(s.time_limit >= 0 && std::isfinite(s.time_limit), "time_limit", s.time_limit,
          "finite and not negative (0 = no limit)");
  require(s.epsilon >= 0 && s.epsilon < 1, "epsilon", s.epsilon, "in [0, 1) (0 = automatic)");
  require(s.grid <= GridMode::hybrid, "grid", static_cast<double>(s.grid), "a GridMode (0 … 4)");
  require(s.grids.start <= kMostGridCells, "grids.start", s.grids.start,
          "at most 1024 (0 = automatic)");
  require(s.grids.resolution <= kMostGridCells, "grids.resolution", s.grids.resolution,
          "at most 1024 (0 = automatic)");
  require(s.grids.refinements <= kMostGridRefinements, "grids.refinements", s.grids.refinements,
          "at most 10 (negative = automatic)");
  if (s.max_spheres == 0 && s.target_coverage >= 1 && s.min_radius <= 0 && s.time_limit <= 0)
    throw Error(
        "packing: no limit is set; set max_spheres, a target_coverage below 1, min_radius or "
        "time_limit");
}

PackingLimits packing_limits(const Solid& solid, double scale, const PackingSettings& settings) {
  PackingLimits limits;
  limits.volume = solid.volume() / scale / scale / scale;
  if (!(limits.volume > 0)) throw Error("packing: the solid's volume is not positive");
  limits.target_coverage = settings.target_coverage;
  limits.min_radius = settings.min_radius / scale;
  limits.epsilon = settings.epsilon;
  limits.max_spheres = settings.max_spheres;
  limits.seed = settings.seed;
  limits.length_unit = scale;
  return limits;
}

void set_progress(Progress& progress, const PackingLimits& limits, std::size_t spheres,
                  double coverage, double radius) {
  progress.spheres = spheres;
  progress.coverage = coverage;
  progress.radius = radius * limits.length_unit;
  // The first sphere reaches a target of 0.
  double fraction = limits.target_coverage > 0
                        ? coverage / limits.target_coverage
                        : static_cast<double>(std::min<std::size_t>(spheres, 1));
  if (limits.max_spheres > 0)
    fraction =
        std::max(fraction, static_cast<double>(spheres) / static_cast<double>(limits.max_spheres));
  progress.fraction = std::min(1.0, fraction);
}

}  // namespace ist::packing
