#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <ist/bake.h>

#include <cstdio>
#include <string>

namespace ist::benchmark {

/// The spheres' bits in one number: equal on every machine and for any number of threads.
inline std::string fingerprint(const SpherePacking& packing) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx",
                static_cast<unsigned long long>(
                    XXH3_64bits(packing.spheres.data(), packing.spheres.size() * sizeof(Sphere))));
  return text;
}

}  // namespace ist::benchmark
