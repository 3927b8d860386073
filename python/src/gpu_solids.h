#pragma once

#include <ist/gpu_query.h>
#include <ist/types.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cuda_calls.h"
#include "solids.h"

// The solids of batches on a device.

namespace ist::python {

/// Solids on a device, and the workspaces of their batches.
class DeviceSolids {
 public:
  DeviceSolids(const std::vector<GpuSolid>& solids, int device) {
    const py::gil_scoped_release released;
    GpuSettings settings;
    settings.device = device;
    solids_ = std::make_unique<GpuSolids>(solids, settings);
  }

  ~DeviceSolids() {
    if (in_flight_.empty()) return;
    const py::gil_scoped_release released;
    in_flight_.back().done->wait();  // their inputs are about to be freed
  }

  const GpuSolids& solids() const { return *solids_; }

  /// Launches a batch after the previous ones, whatever their streams. Returns its completion, or
  /// null if the stream is captured into a graph.
  ///
  /// `lent`: the inputs and outputs of the batch, kept until it is done. `batch`: launches it.
  template <class Launch>
  std::shared_ptr<const cuda::Moment> launch(const GpuPairs& pairs, cuda::Stream stream,
                                             std::vector<std::shared_ptr<void>> lent,
                                             const Launch& batch) {
    // Small and large batches are split differently, so they have separate workspaces: an answer
    // does not depend on earlier queries.
    GpuWorkspace& workspace =
        ready(workspaces_[pairs.count > kFewGpuPairs ? 1 : 0], pairs.count, 4096, stream,
              [](std::size_t most, const GpuSettings& on) { return new GpuWorkspace(most, on); });
    return in_order(stream, std::move(lent), [&] { batch(*solids_, workspace); });
  }

  /// Data that exact batches of a pair_id keep from call to call.
  GpuKept& kept(std::uint32_t pair_id, std::size_t pairs, cuda::Stream stream) {
    return ready(kept_[pair_id], pairs, 64, stream, [](std::size_t most, const GpuSettings& on) {
      return new GpuKept(most, 8192, on);
    });
  }

  /// The same for work without a workspace.
  template <class Launch>
  std::shared_ptr<const cuda::Moment> in_order(cuda::Stream stream,
                                               std::vector<std::shared_ptr<void>> lent,
                                               const Launch& launch) {
    const int device = solids_->device();
    const bool captured = cuda::captures(device, stream);
    if (!captured && !in_flight_.empty()) in_flight_.back().done->hold(stream);
    launch();
    if (captured) return nullptr;
    while (!in_flight_.empty() && in_flight_.front().done->passed()) in_flight_.pop_front();
    in_flight_.push_back({std::make_shared<cuda::Moment>(device, stream), std::move(lent)});
    return in_flight_.back().done;
  }

 private:
  struct Batch {
    std::shared_ptr<const cuda::Moment> done;
    std::vector<std::shared_ptr<void>> lent;
  };

  /// Device memory that grows with the batches.
  template <class Memory>
  struct Growing {
    std::unique_ptr<Memory> now;
    bool captured = false;
    std::vector<std::unique_ptr<Memory>> before;  ///< used by graphs, as long as these solids exist
  };

  /// Memory for so many pairs. make(most, settings) makes a larger one, for `least` or more.
  template <class Memory, class Make>
  Memory& ready(Growing<Memory>& of, std::size_t pairs, std::size_t least, cuda::Stream stream,
                const Make& make) {
    const bool captured = cuda::captures(solids_->device(), stream);
    if (of.now == nullptr || of.now->most_pairs() < pairs) {
      if (captured)
        throw Error("GPU: a batch of " + std::to_string(pairs) +
                    " pairs is captured, but no batch this large ran before: run one without "
                    "capturing first");
      GpuSettings settings;
      settings.device = solids_->device();
      if (!in_flight_.empty()) in_flight_.back().done->wait();
      if (of.captured) of.before.push_back(std::move(of.now));
      of.captured = false;
      of.now.reset();
      std::size_t most = least;
      while (most < pairs) most *= 2;
      of.now.reset(make(most, settings));
    }
    of.captured = of.captured || captured;
    return *of.now;
  }

  std::unique_ptr<GpuSolids> solids_;
  Growing<GpuWorkspace> workspaces_[2];             ///< for small and large batches
  std::map<std::uint32_t, Growing<GpuKept>> kept_;  ///< by pair_id
  std::deque<Batch> in_flight_;
};

}  // namespace ist::python
