#pragma once

#include <nlohmann/json.hpp>

#include "library/job.h"

namespace ist {

/// One part of a library that is split without communication: an asset belongs to the part that the
/// hash of its name selects.
struct Shard {
  std::uint32_t index = 1, count = 1;  ///< 1 … count

  bool holds(const std::string& name) const;
};

/// The result of a run over a library, or over a shard of it.
struct Summary {
  std::string manifest;            ///< path
  std::uint64_t library_hash = 0;  ///< of all jobs of the manifest: equal for shards of one library
  Shard shard;
  double seconds = 0;              ///< wall time; for several shards their sum
  std::vector<std::string> stale;  ///< assets in the output folder that no job names; they are kept
  std::vector<JobResult> results;  ///< by name, sorted

  std::size_t count(JobStatus status) const;
  bool complete() const;  ///< every asset was baked or cached
};

std::uint64_t hash_of_library(const std::vector<Job>& jobs);

/// An entry of `assets` in the JSON below.
nlohmann::ordered_json to_json(const JobResult& result);

/// See docs/json.md. `failed`: only assets that are not done are listed; all are counted.
nlohmann::ordered_json to_json(const Summary& summary, bool failed = false);

/// Reads the output of to_json(). Throws Error (file, fault).
Summary read_summary(const std::string& path);

/// Merges shards 1 … n of one library, in any order. Throws Error if one is missing, duplicate or
/// from another library.
Summary merge(std::vector<Summary> shards);

}  // namespace ist
