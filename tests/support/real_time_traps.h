#pragma once

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <condition_variable>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <thread>

// Traps for what must not happen inside a query. The definitions in real_time_traps.cpp stand
// before the C library's for the whole program.

namespace ist::testing {

/// False under sanitizers, which bring their own heap and locks.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kTrapsWork = false;
#else
inline constexpr bool kTrapsWork = true;
#endif

/// Calls of this thread.
struct Trapped {
  long heap = 0;   ///< malloc, free and their kin; new and delete come down to them
  long locks = 0;  ///< mutexes, conditions, semaphores, once flags, guards of local statics
};

Trapped trapped_so_far() noexcept;

template <class F>
Trapped trapped_by(F f) {
  const Trapped before = trapped_so_far();
  f();
  const Trapped after = trapped_so_far();
  return {after.heap - before.heap, after.locks - before.locks};
}

struct SystemCall {
  bool watched = false;  ///< false: this system cannot tell
  int number = -1;       ///< of the first system call; −1: there was none, and f came to its end
};

namespace detail {
SystemCall first_system_call(void (*f)(void*), void* context);
}

/// Runs f in a child process whose every system call is trapped.
template <class F>
SystemCall first_system_call(F f) {
  return detail::first_system_call([](void* context) { (*static_cast<F*>(context))(); }, &f);
}

}  // namespace ist::testing
