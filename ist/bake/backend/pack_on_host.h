#pragma once

#include <ist/packing.h>

namespace ist::packing {

/// pack() on the threads of the current arena. The settings have been checked.
SpherePacking pack_on_host(const Solid& solid, const PackingSettings& settings,
                           const ProgressCallback& progress);

}  // namespace ist::packing
