#include "cuda/base/pageable_upload.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "cuda/base/check.h"

namespace ist::gpu {
namespace {

constexpr std::size_t kPiece = std::size_t{2} << 20;  ///< [bytes] staged, then fetched
constexpr std::size_t kGrain = std::size_t{1} << 17;  ///< [bytes] that a thread copies at once
constexpr std::size_t kLittle = std::size_t{1}
                                << 20;  ///< [bytes] smaller uploads are left to the driver

/// Memory of the context's pool of pinned memory, for the current device; null if there is none.
std::byte* pinned_memory(cudaStream_t stream, std::size_t bytes) {
  cudaMemLocation host{};
  host.type = cudaMemLocationTypeHost;
  cudaMemAccessDesc access{};
  access.location.type = cudaMemLocationTypeDevice;
  access.flags = cudaMemAccessFlagsProtReadWrite;
  cudaMemPool_t pool = nullptr;
  std::uint64_t keep = std::numeric_limits<std::uint64_t>::max();
  void* memory = nullptr;
  if (cudaGetDevice(&access.location.id) != cudaSuccess ||
      cudaMemGetDefaultMemPool(&pool, &host, cudaMemAllocationTypePinned) != cudaSuccess ||
      cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep) != cudaSuccess ||
      cudaMemPoolSetAccess(pool, &access, 1) != cudaSuccess ||
      cudaMallocFromPoolAsync(&memory, bytes, pool, stream) != cudaSuccess) {
    cudaGetLastError();
    return nullptr;
  }
  return static_cast<std::byte*>(memory);
}

}  // namespace

PageableUpload::PageableUpload(Queue& queue, std::size_t bytes) : queue_(queue) {
  if (bytes < kLittle) return;
  pinned_ = pinned_memory(queue.stream(), bytes);
  // The memory is free only in stream order: an earlier upload may still read it.
  if (pinned_ != nullptr) queue.wait();
}

PageableUpload::~PageableUpload() {
  if (pinned_ != nullptr) cudaFreeAsync(pinned_, queue_.stream());
}

void PageableUpload::copy(void* to, const void* from, std::size_t bytes) {
  const auto fetch = [&](void* device, const void* host, std::size_t size) {
    check(cudaMemcpyAsync(device, host, size, cudaMemcpyHostToDevice, queue_.stream()),
          "copying to the GPU");
  };
  if (bytes == 0) return;
  if (pinned_ == nullptr) return fetch(to, from, bytes);
  std::byte* const carried = pinned_ + used_;
  used_ += bytes;
  for (std::size_t begin = 0; begin < bytes; begin += kPiece) {
    const std::size_t end = std::min(bytes, begin + kPiece);
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(begin, end, kGrain),
                              [&](const oneapi::tbb::blocked_range<std::size_t>& part) {
                                std::memcpy(carried + part.begin(),
                                            static_cast<const std::byte*>(from) + part.begin(),
                                            part.size());
                              });
    fetch(static_cast<std::byte*>(to) + begin, carried + begin, end - begin);
  }
}

}  // namespace ist::gpu
