#pragma once

#include <cstddef>

#include "cuda/base/queue.h"

namespace ist::gpu {

/// Copies from the host's pageable memory to the device, in the order of the queue's stream. All
/// threads copy the bytes into pinned memory, piece by piece, while the device fetches earlier
/// pieces; the driver alone would use one thread. The pinned memory belongs to the CUDA context's
/// pool and stays there for the next upload. Without such a pool, and for small uploads, the driver
/// copies.
class PageableUpload {
 public:
  /// `bytes`: the total of all copies.
  PageableUpload(Queue& queue, std::size_t bytes);
  ~PageableUpload();
  PageableUpload(const PageableUpload&) = delete;
  PageableUpload& operator=(const PageableUpload&) = delete;

  /// On return `from` may be reused if there is pinned memory, else after Queue::wait().
  void copy(void* to, const void* from, std::size_t bytes);

 private:
  Queue& queue_;
  std::byte* pinned_ = nullptr;
  std::size_t used_ = 0;
};

}  // namespace ist::gpu
