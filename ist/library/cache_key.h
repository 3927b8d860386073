#pragma once

#include <cstdint>
#include <string>

#include "library/job.h"

namespace ist {

/// What the bytes of an asset follow from, as a hash of 128 bits.
struct CacheKey {
  std::uint64_t high = 0, low = 0;

  std::string text() const;  ///< 32 hex digits
  bool operator==(const CacheKey&) const = default;
};

/// Of the mesh's bytes, those of the files that it refers to, the settings, the asset's format and
/// the revision of the bake; name, path, device and threads do not count. Throws Error where a file
/// cannot be read.
CacheKey cache_key(const Job& job);

}  // namespace ist
