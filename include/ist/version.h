#pragma once

// The version of these headers, for the preprocessor of C and C++, and of the library loaded at run
// time. CMake reads the three numbers here.

#define IST_VERSION_MAJOR 0
#define IST_VERSION_MINOR 1
#define IST_VERSION_PATCH 0

/// One increasing number: 10000 · major + 100 · minor + patch.
#define IST_VERSION (10000 * IST_VERSION_MAJOR + 100 * IST_VERSION_MINOR + IST_VERSION_PATCH)

#define IST_VERSION_TEXT_OF(number) #number
#define IST_VERSION_TEXT(major, minor, patch) \
  IST_VERSION_TEXT_OF(major) "." IST_VERSION_TEXT_OF(minor) "." IST_VERSION_TEXT_OF(patch)
/// "major.minor.patch"
#define IST_VERSION_STRING IST_VERSION_TEXT(IST_VERSION_MAJOR, IST_VERSION_MINOR, IST_VERSION_PATCH)

#ifdef __cplusplus
#include <cstdint>

#include <ist/types.h>

namespace IST_API ist {

/// IST_VERSION of the loaded library. If it differs from IST_VERSION here, these headers are not
/// those it was built with.
std::uint32_t version() noexcept;

/// True if a program compiled with headers of version `headers` may call this library: the same
/// major number, before 1.0 also the same minor one, and a library that is no older.
bool serves(std::uint32_t headers = IST_VERSION) noexcept;

}  // namespace ist
#endif
