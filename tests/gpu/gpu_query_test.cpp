#include <gtest/gtest.h>

#include <cuda_runtime_api.h>
#include <ist/error.h>
#include <ist/gpu_query.h>

#include "cuda/check.h"
#include "support/gpu_test.h"
#include "support/host_batch.h"
#include "support/random_pairs.h"

// Batches of penetrations on the GPU against the same source on the host, lane by lane: the same
// bits.

namespace ist::testing {
namespace {

class GpuQueryTest : public GpuTest {};

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

/// Pairs and room for their answers on the device.
class DeviceBatch {
 public:
  explicit DeviceBatch(const std::vector<HostBatch::Pair>& pairs)
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
        spheres_(size_) {}

  GpuPairs pairs() const {
    return {size_,          a_.data(),       b_.data(),      pose_a_.data(),
            pose_b_.data(), scale_a_.data(), scale_b_.data()};
  }
  GpuPenetrations answers() const {
    return {volume_.data(), centroid_.data(), push_.data(),   turn_.data(),
            status_.data(), visits_.data(),   spheres_.data()};
  }

  std::vector<Penetration> get() const {
    const auto volume = volume_.get(), centroid = centroid_.get(), push = push_.get(),
               turn = turn_.get();
    const auto status = status_.get();
    const auto visits = visits_.get(), spheres = spheres_.get();
    const auto vector = [](const std::vector<double>& from, std::size_t i) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    std::vector<Penetration> out(size_);
    for (std::size_t i = 0; i < size_; ++i) {
      out[i].volume = volume[i];
      out[i].centroid = vector(centroid, i);
      out[i].translation_gradient = vector(push, i);
      out[i].rotation_gradient = vector(turn, i);
      out[i].status = status[i];
      out[i].node_visits = visits[i];
      out[i].sphere_pairs = spheres[i];
    }
    return out;
  }

 private:
  template <class T, class Get>
  static std::vector<T> column(const std::vector<HostBatch::Pair>& pairs, const Get& get) {
    std::vector<T> out;
    for (const HostBatch::Pair& pair : pairs) out.push_back(get(pair));
    return out;
  }

  std::size_t size_;
  OnDevice<std::uint32_t> a_, b_;
  OnDevice<Pose> pose_a_, pose_b_;
  OnDevice<double> scale_a_, scale_b_;
  OnDevice<double> volume_, centroid_, push_, turn_;
  OnDevice<QueryStatus> status_;
  OnDevice<std::uint32_t> visits_, spheres_;
};

TEST_F(GpuQueryTest, HasTheBitsOfAWarpOnTheHost) {
  std::vector<HostBatch::Pair> pairs = RandomPairs(11).pairs(150);
  pairs[20].pose_b.t[0] = std::nan("");
  pairs[30].scale_b = -1;
  pairs[40].a = 1000;
  const GpuAssets assets(batch_views());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    const DeviceBatch batch(pairs);
    penetration_batch(assets, batch.pairs(), measure, workspace, batch.answers(), stream);
    stream.wait();
    HostBatch host(batch_views());
    expect_same_bits(batch.get(), host.run(pairs, measure, 1));
  }
}

TEST_F(GpuQueryTest, ManyPairsHaveTheSameBitsInEveryRun) {
  const std::vector<HostBatch::Pair> some = RandomPairs(12).pairs(3000);
  std::vector<HostBatch::Pair> pairs;
  for (std::size_t i = 0; i < 300000; ++i) pairs.push_back(some[(i * 7919) % some.size()]);
  const GpuAssets assets(batch_views());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch few(some), many(pairs);
  penetration_batch(assets, few.pairs(), Measure::matched, workspace, few.answers(), stream);
  penetration_batch(assets, many.pairs(), Measure::matched, workspace, many.answers(), stream);
  stream.wait();
  const std::vector<Penetration> expected = few.get();
  std::vector<Penetration> repeated;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    repeated.push_back(expected[(i * 7919) % some.size()]);
  expect_same_bits(many.get(), repeated);
}

TEST_F(GpuQueryTest, AGraphMayCaptureIt) {
  const std::vector<HostBatch::Pair> pairs = RandomPairs(13).pairs(500);
  const GpuAssets assets(batch_views());
  GpuWorkspace workspace(pairs.size());
  const Stream stream;
  const DeviceBatch direct(pairs), captured(pairs);
  penetration_batch(assets, direct.pairs(), Measure::matched, workspace, direct.answers(), stream);
  stream.wait();
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  penetration_batch(assets, captured.pairs(), Measure::matched, workspace, captured.answers(),
                    stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  for (int k = 0; k < 3; ++k) gpu::check(cudaGraphLaunch(ready, stream), "launching a graph");
  stream.wait();
  expect_same_bits(captured.get(), direct.get());
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
}

TEST_F(GpuQueryTest, WhatDoesNotFitIsAnError) {
  const std::vector<HostBatch::Pair> pairs = RandomPairs(14).pairs(5);
  const GpuAssets assets(batch_views());
  GpuWorkspace workspace(4);
  const DeviceBatch batch(pairs);
  EXPECT_THROW(penetration_batch(assets, batch.pairs(), Measure::matched, workspace,
                                 batch.answers(), nullptr),
               Error);
  const TreeView none;
  EXPECT_THROW(GpuAssets({&none, 1}), Error);
  EXPECT_THROW(GpuWorkspace(std::size_t{1} << 40), Error);
  const DeviceBatch empty({});
  penetration_batch(assets, empty.pairs(), Measure::matched, workspace, empty.answers(), nullptr);
}

}  // namespace
}  // namespace ist::testing
