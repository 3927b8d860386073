#pragma once

#include <cstddef>

#include "cuda/base/queue.h"

namespace ist::gpu {

/// Copies from the host's pageable memory to the device, in the order of the queue's stream: all
/// threads carry the bytes into pinned memory, piece by piece, while the card fetches the pieces
/// before; the driver alone does it with one thread. The pinned memory is that of the CUDA
/// context's own pool and stays there for the next upload. Where there is no such pool, and for
/// little, the driver copies.
class PageableUpload {
 public:
  /// `bytes`: of all copies together.
  PageableUpload(Queue& queue, std::size_t bytes);
  ~PageableUpload();
  PageableUpload(const PageableUpload&) = delete;
  PageableUpload& operator=(const PageableUpload&) = delete;

  /// `from` may be used again on return if there is pinned memory, else after Queue::wait().
  void copy(void* to, const void* from, std::size_t bytes);

 private:
  Queue& queue_;
  std::byte* pinned_ = nullptr;
  std::size_t used_ = 0;
};

}  // namespace ist::gpu
