#pragma once

#include <ist/packing.h>

namespace ist::packing {

/// pack() on the CPU, in any mode. The settings have been checked.
SpherePacking pack_on_cpu(const Solid& solid, const PackingSettings& settings,
                          const ProgressCallback& progress);

}  // namespace ist::packing
