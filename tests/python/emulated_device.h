#pragma once

#include <functional>

// A device that is host memory, for tests of ist.gpu: the CUDA functions that the module uses.
//
// Work of a stream is done as late as can be, when somebody waits for it, and then no more than is
// needed. So what is freed, spoiled or read too early is seen.

struct CUstream_st;

namespace ist::testing {

/// After all that the stream was given before.
void do_later(CUstream_st* stream, std::function<void()> work);

}  // namespace ist::testing
