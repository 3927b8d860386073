#pragma once

#include <ist/asset_layout.h>

namespace ist {

/// The counts from which place_sections lays out a surface are small enough for it, so that sums of
/// sizes do not overflow.
bool sound_surface_counts(const SurfaceHeader& surface) noexcept;

/// All that a query reads of a surface whose sections lie within the file. No allocation.
bool sound_surface(const AssetHeader& header, const SurfaceHeader& surface) noexcept;

}  // namespace ist
