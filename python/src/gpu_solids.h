#pragma once

#include <ist/gpu_query.h>
#include <ist/types.h>

#include <cstddef>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cuda_calls.h"
#include "solids.h"

// What batches on a device ask about.

namespace ist::python {

/// Solids on a device, and what their batches work in.
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
    in_flight_.back().done->wait();  // what they read is about to go
  }

  const GpuSolids& solids() const { return *solids_; }

  /// Launches a batch after those before it, on whatever streams they were. Returns when it will
  /// be done, or null where the stream's work goes into a graph.
  ///
  /// `lent`: what the batch reads and writes, kept until it is done. `batch`: launches it.
  template <class Launch>
  std::shared_ptr<const cuda::Moment> launch(const GpuPairs& pairs, cuda::Stream stream,
                                             std::vector<std::shared_ptr<void>> lent,
                                             const Launch& batch) {
    const int device = solids_->device();
    const bool captured = cuda::captures(device, stream);
    // Few pairs and many are cut up differently, in workspaces of their own: an answer does not
    // depend on what was asked before.
    Room& room = rooms_[pairs.count > kFewGpuPairs ? 1 : 0];
    if (room.workspace == nullptr || room.workspace->most_pairs() < pairs.count) {
      if (captured)
        throw Error("GPU: a batch of " + std::to_string(pairs.count) +
                    " pairs is captured, but no batch this large ran before: run one without "
                    "capturing first");
      make_room(room, pairs.count);
    }
    if (captured) room.captured = true;
    return in_order(stream, std::move(lent), [&] { batch(*solids_, *room.workspace); });
  }

  /// Likewise what works in no workspace.
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

  struct Room {
    std::unique_ptr<GpuWorkspace> workspace;
    bool captured = false;
  };

  void make_room(Room& room, std::size_t pairs) {
    GpuSettings settings;
    settings.device = solids_->device();
    if (!in_flight_.empty()) in_flight_.back().done->wait();
    // A graph that was captured uses the old one as long as these solids.
    if (room.captured) captured_.push_back(std::move(room.workspace));
    room = {};
    std::size_t most = 4096;
    while (most < pairs) most *= 2;
    room.workspace = std::make_unique<GpuWorkspace>(most, settings);
  }

  std::unique_ptr<GpuSolids> solids_;
  Room rooms_[2];  ///< of few pairs, and of many
  std::vector<std::unique_ptr<GpuWorkspace>> captured_;
  std::deque<Batch> in_flight_;
};

}  // namespace ist::python
