#include "library/run_jobs.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <new>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include <ist/error.h>
#include <ist/gpu.h>

#include "library/bake_job.h"
#include "library/gpu_places.h"
#include "library/job_queue.h"
#include "library/memory.h"

namespace ist {
namespace {

using Clock = std::chrono::steady_clock;

/// Bakes that have work for a GPU at once: what one leaves of it while it waits for the host,
/// others take. Their host threads are mostly idle.
constexpr int kBakesOnGpu = 3;

/// Whether a bake has work for its GPU, by the stage that it reports.
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

/// What is available is an estimate too, and so are the needs.
std::uint64_t most_of_memory() { return available_memory() / 10 * 8; }

unsigned all_cores() { return static_cast<unsigned>(oneapi::tbb::info::default_concurrency()); }

/// All that threads share; it lives as long as the last of them.
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

  /// What each thread does.
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

  /// What has ended since the last call, after a short wait; false: that was all.
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

  /// Cores are shared by the jobs that run now; the last ones get more of them.
  unsigned threads_of_a_job() {
    const std::size_t sharers = std::clamp<std::size_t>(queue_.waiting() + 1, 1, at_once_);
    return std::max(1u, threads_ / static_cast<unsigned>(sharers));
  }

  Asset bake_mesh(const ClosedMesh& mesh, BakeSettings settings) {
    PackingSettings& packing = settings.packing;
    packing.device = Device::cpu;
    packing.threads = threads_of_a_job();
    std::optional<GpuPlaces::Place> place;
    if (gpus_.places() != 0 && !settings.surface_only) {
      place.emplace(gpus_);
      packing.device = Device::cuda;
      packing.gpu.device = place->gpu();
    }
    if (cancelled_) throw Cancelled();
    const ProgressCallback go_on = [&](const Progress& progress) {
      if (place) place->hold(is_of_gpu(progress));
      return !cancelled_;
    };
    Asset asset = settings.surface_only
                      ? bake_surface(mesh, packing.surface, packing.threads, go_on)
                  : settings.target.relative_error > 0
                      ? bake_to_error(mesh, settings.target, packing, go_on).asset
                      : bake(mesh, packing, go_on);
    // A packing that was cancelled ends with what there is.
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

const char* name_of(JobStatus status) noexcept {
  switch (status) {
    case JobStatus::baked:
      return "baked";
    case JobStatus::cached:
      return "cached";
    case JobStatus::failed:
      return "failed";
    case JobStatus::not_baked:
      return "not_baked";
  }
  return "unknown";
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
