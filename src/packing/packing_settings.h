#pragma once

#include <ist/packing.h>

namespace ist::packing {

/// Throws Error, naming the setting, its value and its range, unless every setting is in range.
void check_settings(const PackingSettings& settings);

}  // namespace ist::packing
