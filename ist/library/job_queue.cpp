#include "library/job_queue.h"

#include <ist/types.h>
#include <unistd.h>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <system_error>
#include <utility>

#include "bake/count_search.h"
#include "mesh/mesh_files.h"

namespace ist {
namespace {

namespace fs = std::filesystem;

std::optional<std::uint64_t> number_in(const fs::path& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? std::optional(value) : std::nullopt;  // "max" is none
}

std::uint64_t machine_memory() {
  std::ifstream file("/proc/meminfo");
  std::string name;
  for (std::uint64_t kilobytes = 0; file >> name >> kilobytes; file.ignore(64, '\n'))
    if (name == "MemAvailable:") return 1024 * kilobytes;
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  return static_cast<std::uint64_t>(std::max(pages, 0L)) *
         static_cast<std::uint64_t>(std::max(page, 0L));
}

/// The memory available in a control group of version 1 or 2, and in those above it.
std::uint64_t group_memory() {
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const bool is_v1 = controllers == "memory";
    if (!is_v1 && !controllers.empty()) continue;
    const fs::path root = is_v1 ? "/sys/fs/cgroup/memory" : "/sys/fs/cgroup";
    fs::path group = line.substr(second + 1);
    for (;; group = group.parent_path()) {
      const fs::path folder = root / group.relative_path();
      const auto limit = number_in(folder / (is_v1 ? "memory.limit_in_bytes" : "memory.max"));
      const auto used = number_in(folder / (is_v1 ? "memory.usage_in_bytes" : "memory.current"));
      if (limit && used) least = std::min(least, *limit - std::min(*used, *limit));
      if (group.relative_path().empty()) break;
    }
  }
  return least;
}

std::uint64_t size_of(const std::string& path) {
  std::error_code none;
  const std::uintmax_t size = fs::file_size(path, none);
  return none ? 0 : size;
}

// Upper bounds, measured over meshes of 10,000 to 871,000 triangles and 1,000 to 50,000 spheres.
constexpr std::uint64_t kFixed = 48 << 20;
constexpr std::uint64_t kPerTriangle = 600;
constexpr std::uint64_t kPerSphere = 20'000;

/// The minimum size of a triangle in a file [bytes].
std::uint64_t bytes_of_triangle(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".stl") return 50;
  if (ending == ".obj" || ending == ".off" || ending == ".dae") return 30;
  return 18;
}

}  // namespace

std::uint64_t available_memory() { return std::min(machine_memory(), group_memory()); }

std::uint64_t memory_of(const Job& job) {
  std::uint64_t size = size_of(job.mesh);
  if (job.mesh.ends_with(".gltf")) {  // its numbers are in files beside it
    try {
      const auto files = files_of_mesh(job.mesh);
      for (std::size_t i = 1; files && i < files->size(); ++i) size += size_of((*files)[i]);
    } catch (const Error&) {  // baking will report the reason
    }
  }
  const std::uint64_t spheres =
      job.settings.packing.max_spheres == 0 ? kMostCounted : job.settings.packing.max_spheres;
  return kFixed + size / bytes_of_triangle(job.mesh) * kPerTriangle + spheres * kPerSphere;
}

int GpuPlaces::take() {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto most = std::max_element(free_.begin(), free_.end());
    if (*most > 0) {
      --*most;
      return static_cast<int>(most - free_.begin());
    }
    changed_.wait(lock);
  }
}

void GpuPlaces::take_on(int gpu) {
  int& free = free_[static_cast<std::size_t>(gpu)];
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return free > 0; });
  --free;
}

void GpuPlaces::give_back(int gpu) {
  const std::lock_guard lock(mutex_);
  ++free_[static_cast<std::size_t>(gpu)];
  changed_.notify_all();
}

JobQueue::JobQueue(std::vector<std::uint64_t> needs, std::uint64_t memory)
    : needs_(std::move(needs)), memory_(memory), waiting_(needs_.size()) {
  // Reversed, so that jobs of equal size are handed out in order.
  std::iota(waiting_.rbegin(), waiting_.rend(), std::size_t{0});
  std::stable_sort(waiting_.begin(), waiting_.end(),
                   [&](std::size_t a, std::size_t b) { return needs_[a] < needs_[b]; });
}

std::optional<std::size_t> JobQueue::take() {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (waiting_.empty()) return std::nullopt;
    const std::uint64_t left = memory_ - std::min(used_, memory_);
    auto best = waiting_.end();
    if (running_ != 0)
      best = std::upper_bound(
          waiting_.begin(), waiting_.end(), left,
          [&](std::uint64_t available, std::size_t job) { return available < needs_[job]; });
    if (best != waiting_.begin()) {
      const std::size_t job = *--best;
      waiting_.erase(best);
      used_ += needs_[job];
      ++running_;
      return job;
    }
    changed_.wait(lock);
  }
}

void JobQueue::give_back(std::size_t job) {
  const std::lock_guard lock(mutex_);
  used_ -= needs_[job];
  --running_;
  changed_.notify_all();
}

void JobQueue::close() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  changed_.notify_all();
}

std::size_t JobQueue::waiting() {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

}  // namespace ist
