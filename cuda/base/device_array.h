#pragma once

#include <cuda_runtime_api.h>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "cuda/base/check.h"
#include "cuda/base/queue.h"

namespace ist::gpu {

/// An uninitialised array in device memory, allocated and freed in the order of a queue's work.
template <class T>
class DeviceArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  DeviceArray() = default;
  DeviceArray(Queue& queue, std::size_t size)
      : queue_(&queue), data_(static_cast<T*>(queue.allocate(size * sizeof(T)))), size_(size) {}
  ~DeviceArray() { release(); }
  DeviceArray(DeviceArray&& other) noexcept { swap(other); }
  DeviceArray& operator=(DeviceArray&& other) noexcept {
    if (this != &other) {
      release();
      swap(other);
    }
    return *this;
  }

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

  void fill_bytes(int value) {
    if (size_ == 0) return;
    check(cudaMemsetAsync(data_, value, bytes(), queue_->stream()), "filling device memory");
  }

  /// Copies to the front of the array, or from it. `from` and `to` must stay valid until
  /// Queue::wait().
  void upload(std::span<const T> from) {
    if (from.empty()) return;
    check(cudaMemcpyAsync(data_, from.data(), from.size_bytes(), cudaMemcpyHostToDevice,
                          queue_->stream()),
          "copying to the GPU");
  }
  void download(std::span<T> to) const {
    if (to.empty()) return;
    check(cudaMemcpyAsync(to.data(), data_, to.size_bytes(), cudaMemcpyDeviceToHost,
                          queue_->stream()),
          "copying from the GPU");
  }

  /// Copies the first `count` elements of another array to the front of this one.
  void copy(const DeviceArray& from, std::size_t count) {
    if (count == 0) return;
    check(cudaMemcpyAsync(data_, from.data_, count * sizeof(T), cudaMemcpyDeviceToDevice,
                          queue_->stream()),
          "moving device memory");
  }

  /// One element, after waiting for it.
  T at(std::size_t index) const {
    T value;
    check(cudaMemcpyAsync(&value, data_ + index, sizeof value, cudaMemcpyDeviceToHost,
                          queue_->stream()),
          "copying from the GPU");
    queue_->wait();
    return value;
  }

  /// The first `count` elements, after waiting for them.
  std::vector<T> to_host(std::size_t count) const {
    std::vector<T> host(count);
    download(std::span<T>(host));
    queue_->wait();
    return host;
  }

  /// Reserves `size` elements and keeps the first `kept` ones.
  void grow(std::size_t size, std::size_t kept) {
    if (size <= size_) return;
    DeviceArray larger(*queue_, size);
    larger.copy(*this, kept);
    swap(larger);
  }

  void release() noexcept {
    if (queue_ != nullptr) queue_->deallocate(data_, bytes());
    data_ = nullptr;
    size_ = 0;
  }

 private:
  void swap(DeviceArray& other) noexcept {
    std::swap(queue_, other.queue_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  Queue* queue_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Replaces every element by the sum of those before it.
void exclusive_sum(Queue& queue, DeviceArray<std::uint32_t>& values);

}  // namespace ist::gpu
