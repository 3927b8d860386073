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

/// The inputs that the assets of a folder were baked from, in its file .ist-bakes: line_of() each,
/// appended when it is written. Incomplete lines are skipped.
class OutputRecord {
 public:
  explicit OutputRecord(const std::filesystem::path& folder);

  /// The asset NAME.ist, if it was written from what the key stands for. Thread-safe.
  std::optional<CacheEntry> find(const std::string& name, const CacheKey& key) const;

  /// From any thread. Throws Error.
  void add(const CacheKey& key, const CacheEntry& entry);

 private:
  const std::filesystem::path folder_;
  std::map<std::string, std::string> lines_;  ///< [key] as they were before this run
  std::mutex mutex_;
};

struct RunSettings {
  std::filesystem::path output;       ///< folder: an asset is output/NAME.ist
  std::shared_ptr<AssetCache> cache;  ///< null: none
  /// Null: what is in the output folder is not looked at.
  std::shared_ptr<OutputRecord> record;
  Device device = Device::automatic;
  unsigned threads = 0;      ///< of all jobs together; 0: all cores
  unsigned jobs = 0;         ///< at once; 0: as many as threads, and besides those that are on GPUs
  std::uint64_t memory = 0;  ///< [bytes] of all jobs together; 0: most of what is available
  /// Returns warnings about an asset; called from any thread.
  std::function<std::vector<std::string>(const AssetView&)> warnings_of;
};

/// Observes a run, from the thread that runs the jobs.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  virtual void finished(const JobResult& result) = 0;  ///< in the order in which jobs end
  virtual void wait_a_little() {}                      ///< ten times a second or so
  virtual bool stop() { return false; }                ///< true: the run is to end
};

struct RunOutcome {
  std::vector<JobResult> results;  ///< in the order of the jobs
  bool stopped = false;            ///< the observer ended it
  /// Some job did not end for a while after that: its thread still runs, and the process is to end
  /// without waiting for it. What it has not written yet it will not leave half written.
  bool abandoned = false;
};

/// Bakes all, several at a time, and writes each asset as it is done. One that fails fails alone.
///
/// How many run at once changes no byte of an asset. Jobs that would take more memory together than
/// there is wait for each other; one that takes more than all of it runs alone.
/// Large jobs begin first. Where a GPU is used, only so many of the jobs bake on it at once as help
/// (see docs/library.md), while others read, cluster and write on the CPU.
RunOutcome run_jobs(const std::vector<Job>& jobs, const RunSettings& settings,
                    RunObserver& observer);

}  // namespace ist
