#include "library/run_jobs.h"

#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <ist/gpu.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>
#include <utility>

#include "bake/asset/atomic_file.h"
#include "library/input_mesh.h"
#include "library/job_queue.h"
#include "library/settings/spelling.h"
#include "robots/description/link_mesh.h"

namespace ist {
namespace {

using Json = nlohmann::ordered_json;

/// The asset of an input mesh. Throws Error; `progress` may cancel.
using BakeMesh = std::function<Asset(const ClosedMesh&, const BakeSettings&)>;

namespace fs = std::filesystem;

/// Does not write if the file already has these bytes.
void write_asset(const fs::path& path, const Asset& asset) {
  std::error_code none;
  if (fs::file_size(path, none) == asset.bytes().size() && !none) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> there(asset.bytes().size());
    const auto* const bytes = reinterpret_cast<const char*>(asset.bytes().data());
    if (file.read(there.data(), static_cast<std::streamsize>(there.size())) &&
        std::equal(there.begin(), there.end(), bytes))
      return;
  }
  asset.save(path);
}

/// True if a machine with more time would give another asset.
bool was_out_of_time(const AssetView& tree) {
  const AssetHeader& h = tree.header();
  const auto late = static_cast<std::uint32_t>(StopReason::time_limit);
  return h.stop_reason == late || (h.asked_error > 0 && h.search_stop == late);
}

void describe(const CacheEntry& entry, const RunSettings& settings, JobResult& result) {
  const AssetView& tree = entry.asset.view();
  result.content_hash = fmt::format("{:016x}", tree.header().content_hash);
  result.bytes = entry.asset.bytes().size();
  result.spheres = tree.sphere_count();
  result.coverage = tree.coverage();
  result.volume = tree.volume();
  result.protrusion = tree.protrusion();
  result.mesh_state = name_of(tree.mesh_state());
  result.mesh_triangles = tree.mesh_triangles();
  result.mesh_error = tree.mesh_error();
  result.self_overlap_volume = tree.self_overlap_volume();
  if (const PredictedErrors errors = tree.predicted_errors(); errors.target_error > 0) {
    result.target_error = errors.target_error;
    result.target_met = errors.target_met();
    if (errors.measured_poses > 0) result.error = errors.measured_error;
  }
  result.confidence = entry.confidence;
  for (std::string& warning : settings.warnings_of(tree))
    result.warnings.push_back(std::move(warning));
  result.warnings.insert(result.warnings.end(), entry.notes.begin(), entry.notes.end());
}

CacheEntry bake_entry(const Job& job, const BakeMesh& bake) {
  InputMesh mesh;
  if (job.shape)
    mesh.closed = close_as_asked(mesh_of(*job.shape, {job.urdf, {}, ""}, job.urdf).mesh, job.mesh,
                                 job.settings.mesh);
  else
    mesh = read_input_mesh(job.mesh, job.settings.mesh);
  CacheEntry entry = {bake(mesh.closed, job.settings), std::move(mesh.closed.report.notes)};
  if (const auto& judged = mesh.closed.report.judged) entry.confidence = judged->confidence;
  return entry;
}

/// Throws Error if an asset does not meet the manifest's requirements.
void check_demands(const Job& job, const CacheEntry& entry) {
  const AssetView& tree = entry.asset.view();
  const Demands& demands = job.demands;
  if (demands.mesh && !tree.has_mesh())
    throw Error(
        fmt::format("{}: require-mesh: the asset keeps no mesh; its input is "
                    "'{}'. Repair the mesh, and keep it with keep-mesh = \"yes\"",
                    job.mesh, name_of(tree.mesh_state())));
  if (!(tree.coverage() >= demands.coverage))
    throw Error(
        fmt::format("{}: min-coverage: spheres fill {:.1f} % of the volume, less than "
                    "{:.1f} %. Allow more spheres",
                    job.mesh, 100 * tree.coverage(), 100 * demands.coverage));
  if (entry.confidence && !(*entry.confidence >= demands.confidence))
    throw Error(
        fmt::format("{}: min-confidence: the closed mesh has a confidence of {:.2f}, less "
                    "than {:.2f}. Repair the mesh by hand",
                    job.mesh, *entry.confidence, demands.confidence));
}

/// Makes an asset from a mesh's file, or takes it from the cache; `bake` is called if it is not
/// there. Throws on any error, but failing to store in the cache is only a warning.
JobResult do_job(const Job& job, const RunSettings& settings, const BakeMesh& bake) {
  JobResult result;
  result.name = job.name;
  result.mesh = job.mesh;
  result.status = JobStatus::baked;

  std::optional<CacheEntry> entry;
  std::optional<CacheKey> key;
  if (settings.cache || settings.record) key = cache_key(job);
  if (settings.record) entry = settings.record->find(job.name, *key);
  if (settings.cache) {
    std::string damage;
    entry = settings.cache->find(*key, damage);
    if (!damage.empty())
      result.warnings.push_back("the cache entry is damaged, so the asset was baked again: " +
                                damage);
  }
  if (entry) result.status = JobStatus::cached;
  const bool baked = !entry;
  if (baked) {
    entry = bake_entry(job, bake);
    if (key && cache_key(job) != *key)
      throw Error(job.mesh + ": the file changed during the bake. Bake it again");
  }
  const bool lasts = baked && !was_out_of_time(entry->asset.view());
  try {
    if (settings.cache && lasts) settings.cache->store(*key, *entry);
  } catch (const Error& error) {
    result.warnings.push_back(std::string("not stored in the cache: ") + error.what());
  }
  check_demands(job, *entry);
  const fs::path path = settings.output / (job.name + ".ist");
  write_asset(path, entry->asset);
  if (settings.record && lasts) settings.record->add(*key, *entry);
  result.asset = path.string();
  describe(*entry, settings, result);
  return result;
}

using Clock = std::chrono::steady_clock;

/// The number of concurrent bakes on a GPU: while one waits for the host, others use the GPU. Their
/// host threads are mostly idle.
constexpr int kBakesOnGpu = 3;

/// True if a bake has work for its GPU in the stage that it reports.
bool is_of_gpu(const Progress& progress) {
  const std::string_view stage = progress.stage;
  return stage == "pack" || stage == "calibrate" || stage == "cover";
}

int gpus_for(Device device) {
  int count = 0;
  if (device != Device::cpu)
    while (gpu_available(count)) ++count;
  return count;
}

std::vector<std::uint64_t> needs_of(const std::vector<Job>& jobs) {
  std::vector<std::uint64_t> needs;
  needs.reserve(jobs.size());
  for (const Job& job : jobs) needs.push_back(memory_of(job));
  return needs;
}

/// A margin: both available memory and the needs are estimates.
std::uint64_t most_of_memory() { return available_memory() / 10 * 8; }

unsigned all_cores() { return static_cast<unsigned>(oneapi::tbb::info::default_concurrency()); }

/// The data shared by all threads; it lives as long as the last of them.
class Run {
 public:
  Run(const std::vector<Job>& jobs, const RunSettings& settings)
      : jobs_(jobs),
        settings_(settings),
        threads_(settings.threads != 0 ? std::min(settings.threads, all_cores()) : all_cores()),
        limit_(oneapi::tbb::global_control::max_allowed_parallelism, threads_),
        gpus_(gpus_for(settings.device), kBakesOnGpu),
        at_once_(std::clamp<std::size_t>(
            jobs.size(), 1, settings.jobs != 0 ? settings.jobs : threads_ + gpus_.places())),
        queue_(needs_of(jobs), settings.memory != 0 ? settings.memory : most_of_memory()),
        working_(at_once_) {}

  std::size_t at_once() const { return at_once_; }

  void work() {
    while (const std::optional<std::size_t> job = queue_.take()) {
      JobResult result = result_of(*job);
      queue_.give_back(*job);
      const std::lock_guard lock(mutex_);
      ended_.emplace_back(*job, std::move(result));
      changed_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    --working_;
    changed_.notify_all();
  }

  void cancel() {
    cancelled_ = true;
    queue_.close();
  }

  /// Waits briefly and collects the jobs that ended since the last call; false: no more follow.
  bool wait(std::vector<std::pair<std::size_t, JobResult>>& ended) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::milliseconds(100),
                      [&] { return !ended_.empty() || working_ == 0; });
    ended = std::exchange(ended_, {});
    return working_ != 0;
  }

 private:
  struct Cancelled {};

  JobResult result_of(std::size_t index) {
    const Job& job = jobs_[index];
    const Clock::time_point start = Clock::now();
    JobResult result;
    const auto fail = [&](const std::string& why) {
      result.status = cancelled_ ? JobStatus::not_baked : JobStatus::failed;
      if (!cancelled_) result.message = why;
    };
    try {
      result = do_job(job, settings_, [this](const ClosedMesh& mesh, const BakeSettings& settings) {
        return bake_mesh(mesh, settings);
      });
    } catch (const Cancelled&) {
    } catch (const std::bad_alloc&) {
      fail(job.mesh + ": out of memory. Reduce --jobs or --memory");
    } catch (const std::exception& error) {
      fail(error.what());
    }
    result.name = job.name;
    result.mesh = job.mesh;
    result.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return result;
  }

  /// Running jobs share the cores; the last ones get more of them.
  unsigned threads_of_a_job() {
    const std::size_t sharers = std::clamp<std::size_t>(queue_.waiting() + 1, 1, at_once_);
    return std::max(1u, threads_ / static_cast<unsigned>(sharers));
  }

  Asset bake_mesh(const ClosedMesh& mesh, BakeSettings settings) {
    PackingSettings& packing = settings.packing;
    packing.device = Device::cpu;
    packing.threads = threads_of_a_job();
    std::optional<GpuPlaces::Place> place;
    if (gpus_.places() != 0 && !settings.mesh_only) {
      place.emplace(gpus_);
      packing.device = Device::cuda;
      packing.gpu.device = place->gpu();
    }
    if (cancelled_) throw Cancelled();
    const ProgressCallback go_on = [&](const Progress& progress) {
      if (place) place->hold(is_of_gpu(progress));
      return !cancelled_;
    };
    Asset asset = bake_as_asked(mesh, settings, go_on).asset;
    // A cancelled packing returns an incomplete result.
    if (cancelled_) throw Cancelled();
    return asset;
  }

  const std::vector<Job> jobs_;
  const RunSettings settings_;
  const unsigned threads_;
  const oneapi::tbb::global_control limit_;
  GpuPlaces gpus_;
  const std::size_t at_once_;
  JobQueue queue_;
  std::atomic<bool> cancelled_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<std::size_t, JobResult>> ended_;
  std::size_t working_;
};

}  // namespace

OutputRecord::OutputRecord(const std::filesystem::path& folder) : folder_(folder) {
  std::ifstream file(folder / ".ist-bakes");
  for (std::string text; std::getline(file, text);) {
    try {
      lines_[Json::parse(text).at("key")] = text;
    } catch (const Json::exception&) {
    }
  }
}

std::optional<CacheEntry> OutputRecord::find(const std::string& name, const CacheKey& key) const {
  const auto line = lines_.find(key.text());
  if (line == lines_.end()) return std::nullopt;
  try {
    return entry_from(line->second, key, Asset::load((folder_ / (name + ".ist")).string()));
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void OutputRecord::add(const CacheKey& key, const CacheEntry& entry) {
  // The line break comes first: a truncated previous line does not corrupt this one.
  const std::string text = '\n' + line_of(key, entry);
  const std::lock_guard lock(mutex_);
  std::ofstream file(folder_ / ".ist-bakes", std::ios::app);
  file.write(text.data(), static_cast<std::streamsize>(text.size())).flush();
  if (!file) throw Error((folder_ / ".ist-bakes").string() + ": cannot write");
}

const char* name_of(JobStatus status) noexcept {
  return word_of(status, {"baked", "cached", "failed", "not_baked"});
}

RunOutcome run_jobs(const std::vector<Job>& jobs, const RunSettings& settings,
                    RunObserver& observer) {
  constexpr auto kPatience = std::chrono::seconds(2);
  RunOutcome outcome;
  for (const Job& job : jobs) {
    outcome.results.emplace_back();
    outcome.results.back().name = job.name;
    outcome.results.back().mesh = job.mesh;
  }
  if (jobs.empty()) return outcome;
  const auto run = std::make_shared<Run>(jobs, settings);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < run->at_once(); ++i) threads.emplace_back([run] { run->work(); });

  Clock::time_point stop_time;
  for (bool more = true; more;) {
    std::vector<std::pair<std::size_t, JobResult>> ended;
    more = run->wait(ended);
    for (auto& [job, result] : ended) {
      outcome.results[job] = std::move(result);
      if (outcome.results[job].status != JobStatus::not_baked)
        observer.finished(outcome.results[job]);
    }
    observer.wait_a_little();
    if (!outcome.stopped && more && observer.stop()) {
      outcome.stopped = true;
      stop_time = Clock::now();
      run->cancel();
    }
    outcome.abandoned = outcome.stopped && more && Clock::now() - stop_time > kPatience;
    if (outcome.abandoned) break;
  }
  for (std::thread& thread : threads) outcome.abandoned ? thread.detach() : thread.join();
  return outcome;
}

}  // namespace ist
