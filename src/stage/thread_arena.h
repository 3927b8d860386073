#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>

namespace ist {

/// Where a stage's threads run: `threads` of them, 0 = all cores, never more than TBB may run, of
/// which it would warn on stderr.
inline oneapi::tbb::task_arena thread_arena(unsigned threads) {
  const std::size_t allowed = oneapi::tbb::global_control::active_value(
      oneapi::tbb::global_control::max_allowed_parallelism);
  const std::size_t used = threads == 0 ? allowed : std::min<std::size_t>(threads, allowed);
  return oneapi::tbb::task_arena(static_cast<int>(used));
}

}  // namespace ist
