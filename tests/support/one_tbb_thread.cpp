// Linked into the tests of a build under the thread sanitizer. TBB synchronises in a library that
// is not built with it: every loop of several threads looks like a race, and its reports take
// minutes. So TBB has no threads there; checked is what runs on threads of the caller's.
#include <tbb/global_control.h>

namespace {

const tbb::global_control kNoWorkers(tbb::global_control::max_allowed_parallelism, 1);

}  // namespace
