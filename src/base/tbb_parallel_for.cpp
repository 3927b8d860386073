#include <ist/query_tbb.h>
#include <tbb/parallel_for.h>

namespace ist {

ParallelFor tbb_parallel_for() noexcept {
  ParallelFor parallel;
  parallel.run = [](void*, std::size_t workers, void (*work)(void*, std::size_t), void* batch) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, workers, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) work(batch, i);
        },
        tbb::simple_partitioner());
  };
  return parallel;
}

}  // namespace ist
