#pragma once

#include <ist/asset.h>
#include <ist/bake.h>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>

#include "library/cache.h"
#include "library/job.h"

namespace ist {

/// The inputs of the assets in a folder, in its file .ist-bakes: one line_of() each, appended when
/// an asset is written. Incomplete lines are skipped.
class OutputRecord {
 public:
  explicit OutputRecord(const std::filesystem::path& folder);

  /// The asset NAME.ist, if it was written from the inputs of this key. Thread-safe.
  std::optional<CacheEntry> find(const std::string& name, const CacheKey& key) const;

  /// Thread-safe. Throws Error.
  void add(const CacheKey& key, const CacheEntry& entry);

 private:
  const std::filesystem::path folder_;
  std::map<std::string, std::string> lines_;  ///< [key] from before this run
  std::mutex mutex_;
};

struct RunSettings {
  std::filesystem::path output;       ///< folder: an asset is output/NAME.ist
  std::shared_ptr<AssetCache> cache;  ///< null: none
  /// Null: existing files in the output folder are not reused.
  std::shared_ptr<OutputRecord> record;
  Device device = Device::automatic;
  unsigned threads = 0;      ///< of all jobs together; 0: all cores
  unsigned jobs = 0;         ///< concurrent; 0: as many as threads, plus those on GPUs
  std::uint64_t memory = 0;  ///< [bytes] of all jobs together; 0: most of the available memory
  /// Returns warnings about an asset; called from any thread.
  std::function<std::vector<std::string>(const AssetView&)> warnings_of;
};

/// Observes a run, from the thread that runs the jobs.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  virtual void finished(const JobResult& result) = 0;  ///< in the order in which jobs end
  virtual void wait_a_little() {}                      ///< called about ten times a second
  virtual bool stop() { return false; }                ///< true: end the run
};

struct RunOutcome {
  std::vector<JobResult> results;  ///< in the order of the jobs
  bool stopped = false;            ///< the observer ended it
  /// Some job did not end for a while after that: its thread still runs, and the process must end
  /// without waiting for it. Files that it has not finished are not left incomplete.
  bool abandoned = false;
};

/// Bakes all jobs, several at a time, and writes each asset when it is done. A failing job does not
/// affect others.
///
/// The number of concurrent jobs changes no byte of an asset. Jobs that together need more memory
/// than available wait for each other; one that needs more than all of it runs alone. Large jobs
/// start first. If a GPU is used, only as many jobs bake on it at once as is beneficial (see
/// docs/library.md), while others read, cluster and write on the CPU.
RunOutcome run_jobs(const std::vector<Job>& jobs, const RunSettings& settings,
                    RunObserver& observer);

}  // namespace ist
