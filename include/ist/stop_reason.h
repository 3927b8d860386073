#pragma once

#include <cstdint>

#include <ist/api.h>

namespace IST_API ist {

/// What ended a packing.
enum class StopReason : std::uint32_t {
  sphere_count,
  coverage,
  min_radius,
  time_limit,
  cancelled,
  exhausted,  ///< nothing above float resolution fits
};

}  // namespace ist
