#pragma once

#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>

#include "base/team.h"

namespace ist::testing {

/// Runs the lanes of a team of the given width on one thread of the host, as a warp runs them on
/// the GPU but in an order that changes from one common call to the next: what is right here needs
/// no luck. Throws where lanes do not make the same calls.
template <int Width>
class Fibers {
 public:
  explicit Fibers(unsigned seed) : random_(seed) {}

  /// body(lane) on every lane; returns when all have returned.
  void run(const std::function<void(int)>& body) {
    body_ = &body;
    Fibers*& current = current_fibers();
    current = this;
    std::fill_n(call_, Width, 0);
    std::fill_n(done_, Width, false);
    round_ = 0;
    for (int i = 0; i < Width; ++i) prepare(i);
    for (bool running = true; running; ++round_) {
      int order[Width];
      for (int i = 0; i < Width; ++i) order[i] = i;
      for (int i = Width - 1; i > 0; --i)
        std::swap(order[i], order[static_cast<int>(random_() % static_cast<unsigned>(i + 1))]);
      for (const int i : order) resume(i);
      running = !done_[0];
      for (int i = 1; i < Width; ++i)
        if (done_[i] != done_[0] || (running && call_[i] != call_[0]))
          throw std::logic_error("lanes of a team went different ways");
    }
  }

  /// One lane's part of a call that all make: gives its value, gets everyone's.
  const std::uint64_t* exchange(int lane, int call, std::uint64_t value) {
    std::uint64_t* slots = slots_[round_ % 2];
    slots[lane] = value;
    call_[lane] = call;
    suspend(lane);
    return slots;
  }

 private:
  static constexpr std::size_t kStackSize = 256 * 1024;
  static Fibers*& current_fibers() {
    static thread_local Fibers* current = nullptr;
    return current;
  }
  // Not inlined: getcontext and setjmp return twice, and a caller's variables would not survive
  // that. A jump makes no system call, as a switch of contexts does.
  [[gnu::noinline]] void prepare(const int lane) {
    if (stack_[lane] == nullptr) stack_[lane] = std::make_unique<char[]>(kStackSize);
    started_[lane] = false;
    getcontext(&start_[lane]);
    start_[lane].uc_stack.ss_sp = stack_[lane].get();
    start_[lane].uc_stack.ss_size = kStackSize;
    makecontext(&start_[lane], reinterpret_cast<void (*)()>(&Fibers::enter), 1, lane);
  }
  [[gnu::noinline]] void resume(int lane) {
    if (_setjmp(main_) != 0) return;
    if (started_[lane]) _longjmp(lane_[lane], 1);
    started_[lane] = true;
    setcontext(&start_[lane]);
  }
  [[gnu::noinline]] void suspend(int lane) {
    if (_setjmp(lane_[lane]) == 0) _longjmp(main_, 1);
  }
  static void enter(int lane) {
    Fibers& fibers = *current_fibers();
    (*fibers.body_)(lane);
    fibers.done_[lane] = true;
    _longjmp(fibers.main_, 1);
  }

  std::mt19937 random_;
  const std::function<void(int)>* body_ = nullptr;
  ucontext_t start_[Width];
  jmp_buf main_, lane_[Width];
  bool started_[Width] = {};
  std::unique_ptr<char[]> stack_[Width];
  int call_[Width] = {};
  bool done_[Width] = {};
  std::uint64_t slots_[2][Width] = {};
  unsigned round_ = 0;
};

/// A team (base/team.h) whose lanes are Fibers.
template <int Width>
class FiberTeam {
 public:
  static constexpr int kWidth = Width;
  static constexpr int kBatch = 1;

  template <class T>
  T* memory(T* p) const {
    return p;
  }

  FiberTeam(Fibers<Width>& fibers, int lane) : fibers_(fibers), lane_(lane) {}

  int lane() const { return lane_; }
  void sync() const { fibers_.exchange(lane_, 1, 0); }

  template <class T>
  T min(T value) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 2, coded(value));
    std::uint64_t least = all[0];
    for (int i = 1; i < Width; ++i) least = all[i] < least ? all[i] : least;
    return decoded<T>(least);
  }
  template <class T>
  T max(T value) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 3, coded(value));
    std::uint64_t most = all[0];
    for (int i = 1; i < Width; ++i) most = all[i] > most ? all[i] : most;
    return decoded<T>(most);
  }
  int sum(int value) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 4, coded(value));
    int total = 0;
    for (int i = 0; i < Width; ++i) total += decoded<int>(all[i]);
    return total;
  }
  /// In the order in which a warp adds.
  double sum(double value) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 8, coded(value));
    double sums[Width], next[Width];
    for (int i = 0; i < Width; ++i) sums[i] = decoded<double>(all[i]);
    for (int apart = Width / 2; apart > 0; apart /= 2) {
      for (int i = 0; i < Width; ++i) next[i] = sums[i] + sums[i ^ apart];
      std::copy_n(next, Width, sums);
    }
    return sums[lane_];
  }
  bool any(bool flag) const { return sum(flag ? 1 : 0) > 0; }
  bool all(bool flag) const { return sum(flag ? 1 : 0) == Width; }
  int exclusive_count(bool flag, int& total) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 5, flag ? 1 : 0);
    int before = 0;
    total = 0;
    for (int i = 0; i < Width; ++i) {
      before += i < lane_ ? static_cast<int>(all[i]) : 0;
      total += static_cast<int>(all[i]);
    }
    return before;
  }
  std::uint32_t ballot(bool flag) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 9, flag ? 1 : 0);
    std::uint32_t raised = 0;
    for (int i = 0; i < Width; ++i) raised |= static_cast<std::uint32_t>(all[i]) << i;
    return raised;
  }
  std::uint32_t alike(std::uint32_t value) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 10, value);
    std::uint32_t same = 0;
    for (int i = 0; i < Width; ++i) same |= (all[i] == value ? 1u : 0u) << i;
    return same;
  }
  int first(bool flag, int& total) const {
    const std::uint64_t* all = fibers_.exchange(lane_, 7, flag ? 1 : 0);
    int found = -1;
    total = 0;
    for (int i = Width - 1; i >= 0; --i) {
      if (all[i] != 0) found = i;
      total += static_cast<int>(all[i]);
    }
    return found;
  }
  template <class T>
  T broadcast(T value, int from) const {
    return decoded<T>(fibers_.exchange(lane_, 6, coded(value))[from]);
  }

 private:
  static std::uint64_t coded(float x) { return ordered_bits(x); }
  static std::uint64_t coded(double x) { return ordered_bits(x); }
  static std::uint64_t coded(std::uint32_t x) { return x; }
  static std::uint64_t coded(std::uint64_t x) { return x; }
  static std::uint64_t coded(int x) {
    return static_cast<std::uint64_t>(std::int64_t{x} + (1ll << 40));
  }
  template <class T>
  static T decoded(std::uint64_t code) {
    if constexpr (std::is_same_v<T, float>)
      return from_ordered_bits(static_cast<std::uint32_t>(code));
    else if constexpr (std::is_same_v<T, double>)
      return from_ordered_bits(code);
    else if constexpr (std::is_same_v<T, int>)
      return static_cast<int>(static_cast<std::int64_t>(code) - (1ll << 40));
    else
      return static_cast<T>(code);
  }

  Fibers<Width>& fibers_;
  int lane_;
};

}  // namespace ist::testing
