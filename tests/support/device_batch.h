#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <vector>

#include <ist/gpu_query.h>
#include <ist/query.h>

#include "cuda/base/check.h"
#include "support/batch_pair.h"

namespace ist::testing {

/// An array in device memory.
template <class T>
class OnDevice {
 public:
  explicit OnDevice(std::size_t size) : size_(size) {
    void* memory = nullptr;
    gpu::check(cudaMalloc(&memory, std::max<std::size_t>(1, size) * sizeof(T)), "allocating");
    data_ = static_cast<T*>(memory);
    gpu::check(cudaMemset(data_, 0xA5, size * sizeof(T)), "filling");
  }
  explicit OnDevice(const std::vector<T>& from) : OnDevice(from.size()) {
    gpu::check(cudaMemcpy(data_, from.data(), size_ * sizeof(T), cudaMemcpyHostToDevice),
               "copying to the GPU");
  }
  ~OnDevice() { cudaFree(data_); }
  OnDevice(const OnDevice&) = delete;
  OnDevice& operator=(const OnDevice&) = delete;

  T* data() const { return data_; }
  std::vector<T> get() const {
    std::vector<T> out(size_);
    gpu::check(cudaMemcpy(out.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost),
               "copying from the GPU");
    return out;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_;
};

class Stream {
 public:
  Stream() { gpu::check(cudaStreamCreate(&stream_), "making a stream"); }
  ~Stream() { cudaStreamDestroy(stream_); }
  operator cudaStream_t() const { return stream_; }
  void wait() const { gpu::check(cudaStreamSynchronize(stream_), "waiting"); }

 private:
  cudaStream_t stream_ = nullptr;
};

/// Pairs and memory for their answers on the device.
class DeviceBatch {
 public:
  explicit DeviceBatch(const std::vector<BatchPair>& pairs)
      : size_(pairs.size()),
        a_(column<std::uint32_t>(pairs, [](const auto& p) { return p.a; })),
        b_(column<std::uint32_t>(pairs, [](const auto& p) { return p.b; })),
        pose_a_(column<Pose>(pairs, [](const auto& p) { return p.pose_a; })),
        pose_b_(column<Pose>(pairs, [](const auto& p) { return p.pose_b; })),
        scale_a_(column<double>(pairs, [](const auto& p) { return p.scale_a; })),
        scale_b_(column<double>(pairs, [](const auto& p) { return p.scale_b; })),
        volume_(size_),
        centroid_(3 * size_),
        push_(3 * size_),
        turn_(3 * size_),
        status_(size_),
        visits_(size_),
        spheres_(size_),
        least_(size_),
        most_(size_),
        area_(size_),
        normal_(3 * size_),
        touching_(size_) {}

  GpuPairs pairs() const {
    return {size_,
            {a_.data(), pose_a_.data(), scale_a_.data()},
            {b_.data(), pose_b_.data(), scale_b_.data()}};
  }
  GpuPenetrations answers() const {
    GpuPenetrations to = {volume_.data(), centroid_.data(), push_.data(),   turn_.data(),
                          status_.data(), visits_.data(),   spheres_.data()};
    to.volume_min = least_.data();
    to.volume_max = most_.data();
    to.contact_area = area_.data();
    to.contact_normal = normal_.data();
    to.touching = reinterpret_cast<bool*>(touching_.data());
    return to;
  }

  std::vector<Penetration> get() const {
    return BatchColumns{volume_.get(), centroid_.get(), push_.get(),    turn_.get(),
                        status_.get(), visits_.get(),   spheres_.get(), least_.get(),
                        most_.get(),   area_.get(),     normal_.get(),  touching_.get()}
        .rows();
  }

 private:
  template <class T, class Get>
  static std::vector<T> column(const std::vector<BatchPair>& pairs, const Get& get) {
    std::vector<T> out;
    for (const BatchPair& pair : pairs) out.push_back(get(pair));
    return out;
  }

  std::size_t size_;
  OnDevice<std::uint32_t> a_, b_;
  OnDevice<Pose> pose_a_, pose_b_;
  OnDevice<double> scale_a_, scale_b_;
  OnDevice<double> volume_, centroid_, push_, turn_;
  OnDevice<QueryStatus> status_;
  OnDevice<std::uint32_t> visits_, spheres_;
  OnDevice<double> least_, most_, area_, normal_;
  OnDevice<std::uint8_t> touching_;
};

}  // namespace ist::testing
