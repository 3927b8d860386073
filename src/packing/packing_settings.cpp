#include "packing/packing_settings.h"

#include <ist/error.h>

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
          "finite and not negative (0 = none)");
  require(s.epsilon >= 0 && s.epsilon < 1, "epsilon", s.epsilon, "in [0, 1) (0 = automatic)");
  require(s.grid <= GridMode::hybrid, "grid", static_cast<double>(s.grid), "a GridMode (0 … 4)");
  require(s.grids.start <= 1024, "grids.start", s.grids.start, "at most 1024 (0 = automatic)");
  require(s.grids.resolution <= 1024, "grids.resolution", s.grids.resolution,
          "at most 1024 (0 = automatic)");
  require(s.grids.refinements <= 10, "grids.refinements", s.grids.refinements,
          "at most 10 (negative = automatic)");
  if (s.max_spheres == 0 && s.target_coverage >= 1 && s.min_radius <= 0 && s.time_limit <= 0)
    throw Error(
        "packing: no limit is set; give a sphere count, a coverage below 1, a smallest radius or a "
        "time");
}

}  // namespace ist::packing
