#pragma once

#include <ist/asset_layout.h>

namespace ist {

/// The counts from which place_sections lays out a field are small enough for it, so that sums of
/// sizes do not overflow.
bool sound_field_counts(const FieldHeader& field) noexcept;

/// All that a query reads of a field whose sections lie within the file. No allocation.
bool sound_field(const AssetHeader& header, const FieldHeader& field) noexcept;

}  // namespace ist
