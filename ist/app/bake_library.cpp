#include "app/bake_library.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/options.h"
#include "app/progress_line.h"
#include "library/asset_summary.h"
#include "library/manifest.h"
#include "library/run_jobs.h"
#include "library/text.h"

namespace ist::app {
namespace {

constexpr double kWindow = 30;  // [s] over which the rate is taken

double seconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

/// "45 s", "3 min 20 s", "2 h 5 min".
std::string in_words(double time) {
  const auto s = static_cast<std::uint64_t>(std::ceil(time));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

/// On a terminal, one line on stderr that is updated with rate and remaining time, below messages
/// of failures; otherwise one line an asset.
class LibraryProgress final : public RunObserver {
 public:
  /// `lines`: one line of JSON on stdout for each asset.
  LibraryProgress(std::size_t jobs, bool quiet, bool lines)
      : jobs_(jobs), quiet_(quiet), lines_(lines), line_(!quiet && isatty(STDERR_FILENO) == 1) {}

  void finished(const JobResult& result) override {
    ++done_;
    cached_ += result.status == JobStatus::cached ? 1 : 0;
    ends_.push_back(Clock::now());
    if (line_) fmt::print(stderr, "{}", kWipe);
    std::fflush(stderr);
    if (lines_) {
      fmt::print("{}\n", json_text(to_json(result), -1));
      std::fflush(stdout);
    }
    const std::string place = fmt::format("[{}/{}] {}", done_, jobs_, result.name);
    if (result.status == JobStatus::failed) {
      ++failed_;
      spdlog::error("{}: failed: {}", place, result.message);
    } else {
      if (!line_)
        spdlog::info("{}: {} in {:.2f} s, {} spheres, {:.1f} %", place, name_of(result.status),
                     result.seconds, grouped(result.spheres), 100 * result.coverage);
      for (const std::string& warning : result.warnings) spdlog::warn("{}: {}", place, warning);
    }
  }

  void wait_a_little() override {
    if (!line_) return;
    const double now = rate();
    std::string left;
    if (now > 0)
      left = fmt::format("  {:.3g} a second  {} left", now,
                         in_words(static_cast<double>(jobs_ - done_) / now));
    fmt::print(stderr, "{}{} of {} assets  {} cached  {} failed{}  {}", kWipe, grouped(done_),
               grouped(jobs_), grouped(cached_), grouped(failed_), left,
               interrupted() ? "stopping" : in_words(seconds(Clock::now() - start_)));
    std::fflush(stderr);
  }

  bool stop() override { return interrupted(); }

  void end() {
    if (line_) fmt::print(stderr, "{}", kWipe);
  }

 private:
  using Clock = std::chrono::steady_clock;
  /// [1/s] of the last half minute; 0: no job ended
  double rate() {
    const Clock::time_point now = Clock::now();
    while (!ends_.empty() && seconds(now - ends_.front()) > kWindow) ends_.pop_front();
    const double window = std::min(seconds(now - start_), kWindow);
    return window > 0 ? static_cast<double>(ends_.size()) / window : 0;
  }

  const std::size_t jobs_;
  const bool quiet_, lines_, line_;
  const Clock::time_point start_ = Clock::now();
  std::size_t done_ = 0, cached_ = 0, failed_ = 0;
  std::deque<Clock::time_point> ends_;  ///< of the last half minute
};

namespace fs = std::filesystem;

std::optional<Shard> parse_shard(std::string_view text) {
  constexpr std::uint32_t kMostShards = 1'000'000;
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto index = parse_whole<std::uint32_t>(text.substr(0, slash));
  const auto count = parse_whole<std::uint32_t>(text.substr(slash + 1));
  if (!index || !count || *index < 1 || *index > *count || *count > kMostShards)
    return std::nullopt;
  return Shard{*index, *count};
}

/// Reads a manifest and reports all its mistakes, before anything is written.
Manifest read_sound_manifest(const std::string& path) {
  Manifest manifest = read_manifest(path);
  if (manifest.faults.empty()) return manifest;
  for (const std::string& fault : manifest.faults) spdlog::error("{}", fault);
  spdlog::error("{}: {} mistake{}; nothing was baked", path, manifest.faults.size(),
                manifest.faults.size() == 1 ? "" : "s");
  throw ExitCode{kExitUsage};
}

/// Assets in the folder that the manifest does not name, and those of jobs that failed.
std::vector<std::string> stale_assets(const std::string& folder, const Manifest& manifest,
                                      const std::vector<JobResult>& results) {
  std::set<std::string> fresh;
  for (const Job& job : manifest.jobs) fresh.insert(job.name + ".ist");
  for (const JobResult& result : results)
    if (result.status == JobStatus::failed) fresh.erase(result.name + ".ist");
  std::vector<std::string> stale;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".ist" && !fresh.contains(entry.path().filename().string()))
      stale.push_back(entry.path().string());
  std::sort(stale.begin(), stale.end());
  return stale;
}

/// Returns the remaining files: all, or none.
std::vector<std::string> settle_stale(std::vector<std::string> stale, bool remove) {
  if (stale.empty()) return stale;
  constexpr std::size_t kShown = 3;
  std::string names;
  for (std::size_t i = 0; i < std::min(kShown, stale.size()); ++i)
    names += (i == 0 ? "" : ", ") + stale[i];
  if (stale.size() > kShown) names += ", …";
  if (!remove) {
    spdlog::warn(
        "stale (not in the manifest, or failed): {} ({}). "
        "--remove-stale removes them",
        names, stale.size());
    return stale;
  }
  for (const std::string& path : stale) fs::remove(path);
  spdlog::info("removed {} stale assets: {}", stale.size(), names);
  return {};
}

/// Writes the index if none of the robot's assets in this run failed.
void write_index(const RobotAssets& robot, const std::string& folder,
                 const std::vector<JobResult>& results) {
  for (const JobResult& result : results)
    for (const Job& job : robot.jobs)
      if (job.name == result.name && !result.done()) return;
  write_text((fs::path(folder) / (robot.name + ".json")).string(), json_text(robot.index) + "\n");
}

void make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!fs::is_directory(path))
    throw Error(path + ": cannot create this folder for the assets" +
                (error ? ": " + error.message() : "") + "; name another with -o");
  if (access(path.c_str(), W_OK | X_OK) != 0)
    throw Error(path + ": no permission to write to this folder; name another with -o");
}

/// An empty name counts as unset, as in other programs.
std::string cache_folder(const LibraryOptions& options) {
  const char* const from_environment = std::getenv("IST_CACHE");
  if (!options.cache.empty()) return options.cache;
  return from_environment != nullptr ? from_environment : "";
}

void print_jobs(const std::vector<Job>& jobs, bool json) {
  if (json) {
    auto assets = nlohmann::ordered_json::array();
    for (const Job& job : jobs) assets.push_back({{"name", job.name}, {"mesh", job.mesh}});
    return fmt::print("{}\n", json_text({{"assets", assets}}));
  }
  for (const Job& job : jobs) fmt::print("{}  {}\n", job.name, job.mesh);
  fmt::print("{} assets; nothing was baked\n", jobs.size());
}

RunSettings settings_for(const LibraryRun& run) {
  RunSettings settings;
  settings.output = run.output;
  settings.device = usable_device(run.device);
  settings.threads = run.threads;
  settings.jobs = run.library.jobs;
  settings.memory = run.library.memory.value_or(0);
  settings.warnings_of = warnings_of;
  return settings;
}

}  // namespace

std::vector<std::string> warnings_of(const AssetView& tree) {
  std::vector<std::string> warnings;
  if (const PredictedErrors errors = tree.predicted_errors();
      errors.target_error > 0 && !errors.target_met())
    warnings.push_back(describe_target(tree));
  if (std::string coarse = describe_coarseness(tree); !coarse.empty())
    warnings.push_back(std::move(coarse));
  if (std::string twice = describe_counted_twice(tree); !twice.empty())
    warnings.push_back(std::move(twice));
  return warnings;
}

void add_library_options(CLI::App* command, LibraryOptions& options) {
  CLI::Option* const manifest =
      add_input(command, "--manifest", options.manifest,
                "Bake every mesh that this TOML file lists (docs/library.md)")
          ->required(false);
  add_input(command, "--cache", options.cache,
            "With --manifest: cache folder; an asset whose mesh and settings did not change is "
            "copied from it instead of baked again. Default: $IST_CACHE, else no cache")
      ->required(false)
      ->needs(manifest);
  add_bytes(command, "--cache-size", options.cache_size,
            "With --manifest: size limit of the cache in bytes, e.g. 10G; the least recently used "
            "assets are removed first. Default: no limit")
      ->needs(manifest);
  add_parsed(
      command, "--shard", "I/N with I from 1 to N, e.g. 2/8",
      [&options](const std::string& text) {
        options.shard = text;
        return parse_shard(text).has_value();
      },
      "With --manifest: bake part I of N; `ist summary` merges the summaries of all parts")
      ->type_name("I/N")
      ->needs(manifest);
  command
      ->add_flag("--remove-stale", options.remove_stale,
                 "With --manifest: remove assets from the folder that the manifest does not name, "
                 "or whose bake failed")
      ->needs(manifest);
  command
      ->add_flag("--list", options.list,
                 "With --manifest: print the assets and their meshes, and bake nothing")
      ->needs(manifest);
  command
      ->add_flag("--json-lines", options.lines,
                 "With --manifest: print a line of JSON as each asset is done, then the summary as "
                 "the last line")
      ->needs(manifest);
  constexpr unsigned kMostJobs = 1024;
  add_whole(command, "--jobs", options.jobs,
            "With --manifest: number of assets baked at once; 0 = as many as threads. The result "
            "does not depend on it",
            0u, kMostJobs)
      ->needs(manifest);
  add_bytes(command, "--memory", options.memory,
            "With --manifest: memory limit in bytes, e.g. 16G; an asset waits until its estimated "
            "memory is free. Default: 80 % of the available memory")
      ->needs(manifest);
}

void run_library(const LibraryRun& run) {
  const auto start = std::chrono::steady_clock::now();
  if (run.quiet) spdlog::set_level(spdlog::level::err);
  const Manifest manifest = read_sound_manifest(run.library.manifest);
  for (const std::string& warning : manifest.warnings) spdlog::warn("{}", warning);
  Shard shard;
  if (!run.library.shard.empty()) shard = *parse_shard(run.library.shard);
  std::vector<Job> jobs;
  for (const Job& job : manifest.jobs)
    if (shard.holds(job.name)) jobs.push_back(job);
  if (run.library.list) return print_jobs(jobs, run.json);
  RunSettings settings = settings_for(run);
  const std::string cache = cache_folder(run.library);
  const std::uint64_t cache_size = run.library.cache_size.value_or(0);
  if (cache.empty() && cache_size != 0)
    throw CLI::ValidationError("--cache-size", "has no effect without --cache or IST_CACHE");
  make_folder(run.output);
  announce_device(settings.device);
  if (!cache.empty())
    settings.cache = std::make_shared<AssetCache>(cache, cache_size);
  else
    settings.record = std::make_shared<OutputRecord>(run.output);

  Summary summary;
  summary.manifest = run.library.manifest;
  summary.library_hash = hash_of_library(manifest.jobs);
  summary.shard = shard;

  const InterruptGuard guard;
  LibraryProgress progress(jobs.size(), run.quiet, run.library.lines);
  RunOutcome outcome = run_jobs(jobs, settings, progress);
  progress.end();
  if (settings.cache && cache_size != 0 && !outcome.stopped) prune_cache(cache, cache_size);
  summary.results = std::move(outcome.results);
  if (!outcome.stopped)
    summary.stale =
        settle_stale(stale_assets(run.output, manifest, summary.results), run.library.remove_stale);
  for (const RobotAssets& robot : manifest.robots) write_index(robot, run.output, summary.results);
  summary.seconds = seconds_since(start);
  if (run.library.lines)
    fmt::print("{}\n", json_text(to_json(summary), -1));
  else
    print_summary(summary, run.json, run.quiet);
  if (outcome.abandoned) {
    std::fflush(stdout);
    _exit(kExitInterrupted);
  }
  exit_if_interrupted();
  if (!summary.complete()) throw ExitCode{kExitError};
}

}  // namespace ist::app
