#include "library/gpu_places.h"

#include <algorithm>

namespace ist {

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

}  // namespace ist
