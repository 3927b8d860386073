#include "cuda/base/queue.h"

#include <ist/types.h>

#include <algorithm>
#include <limits>
#include <string>

#include "cuda/base/check.h"

namespace ist::gpu {
namespace {

/// The device's default memory pool. Memory that a bake frees stays in the pool for the next bake.
class DevicePool final : public DeviceMemoryResource {
 public:
  explicit DevicePool(int device) {
    cudaMemPool_t pool = nullptr;
    check(cudaDeviceGetDefaultMemPool(&pool, device), "finding the device's memory pool");
    std::uint64_t keep = std::numeric_limits<std::uint64_t>::max();
    check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep),
          "setting up the device's memory pool");
  }

  void* allocate(std::size_t bytes, CUstream_st* stream) override {
    void* memory = nullptr;
    const cudaError_t status = cudaMallocAsync(&memory, bytes, stream);
    if (status == cudaErrorMemoryAllocation) {
      cudaGetLastError();
      return nullptr;
    }
    check(status, "allocating device memory");
    return memory;
  }

  void deallocate(void* memory, std::size_t, CUstream_st* stream) noexcept override {
    cudaFreeAsync(memory, stream);
  }
};

}  // namespace

DeviceGuard::DeviceGuard(int device) {
  check(cudaGetDevice(&previous_), "looking for a GPU");
  check(cudaSetDevice(device), "selecting the GPU");
}

DeviceGuard::~DeviceGuard() { cudaSetDevice(previous_); }

Queue::Queue(const GpuSettings& settings, bool waits)
    : guard_(settings.device), memory_(settings.memory), stream_(settings.stream) {
  check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, settings.device),
        "querying the GPU's size");
  if (memory_ == nullptr) {
    own_memory_ = std::make_unique<DevicePool>(settings.device);
    memory_ = own_memory_.get();
  }
  if (stream_ == nullptr) {
    int least = 0, greatest = 0;
    check(cudaDeviceGetStreamPriorityRange(&least, &greatest),
          "querying the GPU's stream priorities");
    const int priority =
        waits ? least : std::max(least - 1, greatest);  // a smaller number is a higher priority
    check(cudaStreamCreateWithPriority(&stream_, cudaStreamNonBlocking, priority),
          "making a stream");
    own_stream_ = true;
  }
}

Queue::~Queue() {
  if (!own_stream_) return;
  cudaStreamSynchronize(stream_);
  cudaStreamDestroy(stream_);
}

void* Queue::allocate(std::size_t bytes) {
  if (bytes == 0) return nullptr;
  void* memory = memory_->allocate(bytes, stream_);
  if (memory == nullptr)
    throw Error(
        "GPU: no device memory left for " + std::to_string(bytes) + " more bytes (" +
        std::to_string(in_use_) +
        " in use on this stream): free device memory, use fewer spheres, or bake on the CPU");
  in_use_ += bytes;
  peak_ = std::max(peak_, in_use_);
  return memory;
}

void Queue::deallocate(void* memory, std::size_t bytes) noexcept {
  if (memory == nullptr) return;
  memory_->deallocate(memory, bytes, stream_);
  in_use_ -= bytes;
}

void Queue::wait() { check(cudaStreamSynchronize(stream_), "waiting for the GPU"); }

}  // namespace ist::gpu
