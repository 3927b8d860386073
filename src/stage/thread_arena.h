#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
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

/// Calls work(i) for all i in [from, to) on the threads of the current arena, `grain` or more at a
/// time.
template <class Work>
void for_each_index(std::size_t from, std::size_t to, std::size_t grain, const Work& work) {
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(from, to, grain),
                            [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                            });
}

}  // namespace ist
