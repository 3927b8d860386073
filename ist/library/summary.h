#pragma once

#include <nlohmann/json.hpp>

#include "library/job.h"

namespace ist {

/// One of the parts into which a library is split with no word between them: an asset is in the
/// part that the hash of its name says.
struct Shard {
  std::uint32_t index = 1, count = 1;  ///< 1 … count

  bool holds(const std::string& name) const;
};

/// The result of a run over a library, or over a shard of it.
struct Summary {
  std::string manifest;            ///< path
  std::uint64_t library_hash = 0;  ///< of all jobs of the manifest: equal for shards of one library
  Shard shard;
  double seconds = 0;              ///< wall time; of several shards: their sum
  std::vector<std::string> stale;  ///< assets in the output folder that no job names; left there
  std::vector<JobResult> results;  ///< by name, sorted

  std::size_t count(JobStatus status) const;
  bool complete() const;  ///< every asset was baked or cached
};

std::uint64_t hash_of_library(const std::vector<Job>& jobs);

/// An entry of `assets` of the next.
nlohmann::ordered_json to_json(const JobResult& result);

/// docs/json.md describes it. `failed`: only assets that are not done are listed; all are counted.
nlohmann::ordered_json to_json(const Summary& summary, bool failed = false);

/// Reads what to_json() gave. Throws Error (file, what is wrong).
Summary read_summary(const std::string& path);

/// Shards 1 … n of one library, in any order, as one. Throws Error where one is missing, is there
/// twice or is of another library.
Summary merge(std::vector<Summary> shards);

}  // namespace ist
