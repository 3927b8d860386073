#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <span>
#include <utility>

#include <ist/error.h>
#include <ist/gpu.h>

#include "cuda/check.h"
#include "cuda/queue.h"

namespace ist::gpu {

/// Device memory that outlives the queue it comes from.
class DeviceBytes {
 public:
  DeviceBytes() = default;
  DeviceBytes(Queue& queue, const GpuSettings& settings, std::size_t bytes)
      : settings_(settings), data_(queue.allocate(bytes)), bytes_(bytes) {}
  ~DeviceBytes() {
    if (data_ == nullptr) return;
    try {
      Queue(settings_).deallocate(data_, bytes_);
    } catch (const Error&) {  // a device that is gone has no memory to give back
    }
  }
  DeviceBytes(DeviceBytes&& other) noexcept { *this = std::move(other); }
  DeviceBytes& operator=(DeviceBytes&& other) noexcept {
    std::swap(settings_, other.settings_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }

  std::byte* data() const { return static_cast<std::byte*>(data_); }
  std::size_t bytes() const { return bytes_; }

 private:
  GpuSettings settings_;
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// Parts of a block of memory, one after another.
class Parts {
 public:
  explicit Parts(std::byte* from) : from_(from) {}

  template <class T>
  T* take(std::size_t count) {
    T* const part = reinterpret_cast<T*>(from_ + used_);
    used_ += (count * sizeof(T) + 255) / 256 * 256;
    return part;
  }
  std::size_t used() const { return used_; }

 private:
  std::byte* from_;
  std::size_t used_ = 0;
};

inline void copy_to_device(void* to, const void* from, std::size_t bytes, Queue& queue) {
  check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, queue.stream()),
        "copying to the GPU");
}

template <class T>
void copy_to_device(T* to, std::span<const T> from, Queue& queue) {
  if (!from.empty()) copy_to_device(to, from.data(), from.size_bytes(), queue);
}

}  // namespace ist::gpu
