#include "query/asset/content_hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <ist/asset_layout.h>

namespace ist {

std::uint64_t content_hash(std::span<const std::byte> bytes) noexcept {
  constexpr std::size_t kField = offsetof(AssetHeader, content_hash);
  constexpr std::size_t kAfter = kField + sizeof(AssetHeader::content_hash);
  constexpr std::byte kZero[kAfter - kField] = {};
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, bytes.data(), kField);
  XXH3_64bits_update(&state, kZero, sizeof(kZero));
  XXH3_64bits_update(&state, bytes.data() + kAfter, bytes.size() - kAfter);
  return XXH3_64bits_digest(&state);
}

}  // namespace ist
