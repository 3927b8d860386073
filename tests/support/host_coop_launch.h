#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "base/team.h"
#include "cuda/packing/banded/banded_state.h"

namespace ist::testing {

/// A cooperative launch (cuda/packing/banded/banded_state.h) of host threads, each a team of one.
template <class Scratch_>
class HostCoopLaunch {
 public:
  using Team = SerialTeam;
  using Lane = SerialTeam;
  using Scratch = Scratch_;

  struct Meeting {
    std::mutex mutex;
    std::condition_variable all_here;
    std::uint32_t here = 0, generation = 0;
  };

  HostCoopLaunch(Meeting& meeting, std::uint32_t index, std::uint32_t size)
      : meeting_(meeting), index_(index), size_(size) {}

  const Team& team() const { return team_; }
  Scratch& scratch() { return scratch_; }
  std::uint32_t index() const { return index_; }
  std::uint32_t size() const { return size_; }

  void pause() const { std::this_thread::yield(); }

  template <class Last>
  void sync(const Last& last) {
    std::unique_lock lock(meeting_.mutex);
    const std::uint32_t generation = meeting_.generation;
    if (++meeting_.here == size_) {
      meeting_.here = 0;
      last();
      ++meeting_.generation;
      meeting_.all_here.notify_all();
    } else {
      meeting_.all_here.wait(lock, [&] { return meeting_.generation != generation; });
    }
  }

 private:
  Meeting& meeting_;
  std::uint32_t index_, size_;
  Team team_;
  Scratch scratch_{};
};

/// Calls work(coop) in `size` threads.
template <class Scratch, class Work>
void run_launch(std::uint32_t size, const Work& work) {
  typename HostCoopLaunch<Scratch>::Meeting meeting;
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < size; ++i)
    threads.emplace_back([&, i] {
      HostCoopLaunch<Scratch> coop(meeting, i, size);
      work(coop);
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace ist::testing
