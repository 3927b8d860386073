#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "library/cache.h"

namespace ist {

/// What the assets of a folder were baked from, in its file .ist-bakes: a line an asset, appended
/// when it is written. A line that is not whole is passed over.
class OutputRecord {
 public:
  explicit OutputRecord(const std::filesystem::path& folder);

  /// The asset NAME.ist, if it is the one that was written from what the key stands for. From any
  /// thread.
  std::optional<CacheEntry> find(const std::string& name, const CacheKey& key) const;

  /// From any thread. Throws Error.
  void add(const std::string& name, const CacheKey& key, const CacheEntry& entry);

 private:
  struct Line {
    std::string key, hash;
    std::vector<std::string> notes;
    std::optional<double> confidence;
  };
  const std::filesystem::path folder_;
  std::map<std::string, Line> lines_;  ///< as they were before this run
  std::mutex mutex_;
};

}  // namespace ist
