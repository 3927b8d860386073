#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

namespace ist {

/// Places for bakes on the GPUs of this machine. For many threads.
class GpuPlaces {
 public:
  GpuPlaces(int gpus, int on_each)
      : places_(static_cast<std::size_t>(gpus * on_each)),
        free_(static_cast<std::size_t>(gpus), on_each) {}

  std::size_t places() const { return places_; }  ///< free and taken; 0: no GPU

  /// A place on the GPU with the most free ones; waits for one.
  class Place {
   public:
    explicit Place(GpuPlaces& places) : places_(places), gpu_(places.take()) {}
    ~Place() { hold(false); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    int gpu() const { return gpu_; }

    /// Gives the place back for a while, or waits for one on the same GPU again.
    void hold(bool wanted) {
      if (wanted == held_) return;
      wanted ? places_.take_on(gpu_) : places_.give_back(gpu_);
      held_ = wanted;
    }

   private:
    GpuPlaces& places_;
    const int gpu_;
    bool held_ = true;
  };

 private:
  int take();
  void take_on(int gpu);
  void give_back(int gpu);

  const std::size_t places_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int> free_;  ///< places, by GPU
};

}  // namespace ist
