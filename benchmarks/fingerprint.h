#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <ist/bake.h>

#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <string>

#include "report.h"
#include "support/shared_data.h"

namespace ist::benchmark {

/// The spheres' bits in one number: equal on every machine and for any number of threads.
inline std::string fingerprint(const SpherePacking& packing) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx",
                static_cast<unsigned long long>(
                    XXH3_64bits(packing.spheres.data(), packing.spheres.size() * sizeof(Sphere))));
  return text;
}

/// visit(name, closed mesh) of each of these files of shared data; a missing one is a remark.
template <class Visit>
void for_shared_meshes(Report& report, std::initializer_list<const char*> files,
                       const Visit& visit) {
  for (const char* file : files) {
    const std::filesystem::path path = testing::shared_path(file);
    if (!std::filesystem::exists(path)) {
      report.remark("missing: " + std::string(file));
      continue;
    }
    const std::string name = path.stem().string();
    visit(name, close_mesh(load_mesh(path.string()), name));
  }
}

}  // namespace ist::benchmark
