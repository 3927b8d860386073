#pragma once

#include <cuda_runtime_api.h>
#include <ist/gpu.h>

#include <cstddef>

namespace ist::testing {

/// Device memory that gives out no more than so many bytes at a time.
class ScarceMemory final : public DeviceMemoryResource {
 public:
  explicit ScarceMemory(std::size_t bytes) : left_(bytes) {}

  void* allocate(std::size_t bytes, CUstream_st* stream) override {
    void* memory = nullptr;
    if (bytes > left_ || cudaMallocAsync(&memory, bytes, stream) != cudaSuccess) return nullptr;
    left_ -= bytes;
    return memory;
  }
  void deallocate(void* memory, std::size_t bytes, CUstream_st* stream) noexcept override {
    cudaFreeAsync(memory, stream);
    left_ += bytes;
  }

  std::size_t left() const { return left_; }  ///< all of it once nothing is in use

 private:
  std::size_t left_;
};

}  // namespace ist::testing
