#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ist {

/// XXH3-64 of an asset's bytes, at least a header, with AssetHeader::content_hash taken as zero.
std::uint64_t content_hash(std::span<const std::byte> bytes) noexcept;

}  // namespace ist
