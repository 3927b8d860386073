#pragma once

#include <cuda_runtime_api.h>
#include <ist/gpu.h>

#include <cstddef>
#include <memory>

namespace ist::gpu {

/// Makes a device current, and restores the previous one at the end.
class DeviceGuard {
 public:
  explicit DeviceGuard(int device);
  ~DeviceGuard();
  DeviceGuard(const DeviceGuard&) = delete;
  DeviceGuard& operator=(const DeviceGuard&) = delete;

 private:
  int previous_ = 0;
};

/// The stream on which a backend's device work runs in order, and the source of its memory. One per
/// backend; not shared by threads. Its device must be current (DeviceGuard) wherever it is used.
class Queue {
 public:
  /// `waits`: the work of other queues takes precedence, if the stream is this queue's own. Throws
  /// Error if the device cannot be used.
  explicit Queue(const GpuSettings& settings, bool waits = false);
  ~Queue();
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;

  cudaStream_t stream() const { return stream_; }
  int multiprocessors() const { return multiprocessors_; }

  /// Throws Error if memory is exhausted. Returns nullptr for 0 bytes.
  void* allocate(std::size_t bytes);
  void deallocate(void* memory, std::size_t bytes) noexcept;

  std::size_t bytes_in_use() const { return in_use_; }
  std::size_t peak_bytes() const { return peak_; }  ///< largest bytes_in_use() so far
  void reset_peak() { peak_ = in_use_; }

  /// Waits for all work of the stream; throws Error if any of it failed.
  void wait();

 private:
  DeviceGuard guard_;
  std::unique_ptr<DeviceMemoryResource> own_memory_;
  DeviceMemoryResource* memory_ = nullptr;
  cudaStream_t stream_ = nullptr;
  bool own_stream_ = false;
  int multiprocessors_ = 0;
  std::size_t in_use_ = 0, peak_ = 0;
};

}  // namespace ist::gpu
