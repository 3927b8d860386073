#pragma once

#include <ist/asset_layout.h>

namespace ist {

/// The mass properties and bounds of an asset could be those of some solid.
bool sound_mass(const AssetHeader& header) noexcept;

}  // namespace ist
