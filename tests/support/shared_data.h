#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace ist::testing {

/// A path in the folder of the oracle and the meshes: the environment variable IST_SHARED, else
/// ../shared beside the source tree.
inline std::filesystem::path shared_path(const std::string& relative) {
  const char* root = std::getenv("IST_SHARED");
  const std::filesystem::path base = root != nullptr
                                         ? std::filesystem::path(root)
                                         : std::filesystem::path(IST_SOURCE_DIR) / ".." / "shared";
  return base / relative;
}

inline bool shared_required() {
  const char* flag = std::getenv("IST_REQUIRE_SHARED");
  return flag != nullptr && std::string(flag) == "1";
}

}  // namespace ist::testing

/// Skips the test, visibly, where the shared file is missing; fails it under IST_REQUIRE_SHARED=1.
#define IST_NEEDS_SHARED(relative)                                                          \
  do {                                                                                      \
    if (!std::filesystem::exists(ist::testing::shared_path(relative))) {                    \
      if (ist::testing::shared_required()) FAIL() << "missing shared data: " << (relative); \
      GTEST_SKIP() << "no shared data (IST_SHARED): " << (relative);                        \
    }                                                                                       \
  } while (false)
