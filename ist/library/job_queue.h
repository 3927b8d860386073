#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "library/job.h"

namespace ist {

/// [bytes] still available to this process, from the machine and from its control groups.
std::uint64_t available_memory();

/// [bytes] Upper estimate of a job's memory, from its mesh file's size and sphere count.
std::uint64_t memory_of(const Job& job);

/// Slots for bakes on the GPUs of this machine. Thread-safe.
class GpuPlaces {
 public:
  GpuPlaces(int gpus, int on_each)
      : places_(static_cast<std::size_t>(gpus * on_each)),
        free_(static_cast<std::size_t>(gpus), on_each) {}

  std::size_t places() const { return places_; }  ///< free and used; 0: no GPU

  /// A slot on the GPU with the most free slots; waits for one.
  class Place {
   public:
    explicit Place(GpuPlaces& places) : places_(places), gpu_(places.take()) {}
    ~Place() { hold(false); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    int gpu() const { return gpu_; }

    /// Releases the slot temporarily, or waits for one on the same GPU again.
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

/// Hands out jobs, the largest first, as memory allows. Thread-safe.
class JobQueue {
 public:
  /// `needs` [bytes] of each job; `memory` [bytes] of all running jobs.
  JobQueue(std::vector<std::uint64_t> needs, std::uint64_t memory);

  /// The largest job that fits beside the running ones, or the largest of all if none runs. Waits
  /// for others to end if none fits. Nothing: there are no more jobs.
  std::optional<std::size_t> take();

  void give_back(std::size_t job);  ///< a job from take(), once it has ended
  void close();                     ///< stops handing out jobs
  std::size_t waiting();            ///< jobs not taken yet

 private:
  const std::vector<std::uint64_t> needs_;
  const std::uint64_t memory_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::size_t> waiting_;  ///< the smallest first
  std::uint64_t used_ = 0;
  std::size_t running_ = 0;
};

}  // namespace ist
