#pragma once

#include <condition_variable>
#include <mutex>
#include <vector>

namespace ist {

/// Places for bakes on the GPUs of this machine. For many threads.
class GpuPlaces {
 public:
  GpuPlaces(int gpus, int on_each) : free_(static_cast<std::size_t>(gpus), on_each) {}

  bool none() const { return free_.empty(); }

  /// A place while it lives, on the GPU with the most free ones; waits for one.
  class Place {
   public:
    explicit Place(GpuPlaces& places) : places_(places), gpu_(places.take()) {}
    ~Place() { places_.give_back(gpu_); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    int gpu() const { return gpu_; }

   private:
    GpuPlaces& places_;
    const int gpu_;
  };

 private:
  int take();
  void give_back(int gpu);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int> free_;  ///< places, by GPU
};

}  // namespace ist
