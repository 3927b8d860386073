#pragma once

#include <chrono>
#include <future>
#include <type_traits>
#include <utility>

#include "stage/thread_arena.h"

namespace ist {

/// Does work on a thread of its own, whose loops have `threads` threads of theirs. Waits for it
/// where the future is dropped.
template <class Work>
std::future<std::invoke_result_t<Work>> do_aside(unsigned threads, Work work) {
  return std::async(std::launch::async, [threads, work = std::move(work)] {
    return thread_arena(threads).execute(work);
  });
}

/// Asks `meanwhile` twenty times a second until a result is there.
template <class Future, class Meanwhile>
void wait_for(const Future& future, const Meanwhile& meanwhile) {
  while (future.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) meanwhile();
}

}  // namespace ist
