#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ist {

/// XXH3-64 of an asset's bytes, AssetHeader::content_hash taken as zero. `bytes` must contain at
/// least the header. No allocation.
std::uint64_t content_hash(std::span<const std::byte> bytes) noexcept;

}  // namespace ist
