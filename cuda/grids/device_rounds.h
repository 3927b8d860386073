#pragma once

#include <functional>
#include <vector>

#include "cuda/grids/device_grid.h"
#include "packing/grids/grid_rounds.h"

namespace ist::gpu {

/// The prototype grid in device memory and what a round does with it, a warp a prototype.
class DevicePrototypes {
 public:
  explicit DevicePrototypes(Queue& queue) : queue_(&queue), counters_(queue, 4) {}

  void place(const packing::GridLayout& layout);
  void split();

  /// Keeps the active cells and lets their prototypes converge; false if `go_on` gave up.
  bool converge(const packing::GridScene& scene, const packing::AscentSettings& settings,
                const packing::GoOn& go_on);
  /// Of the last converge().
  std::vector<packing::GridWinner> winners(const packing::GridScene& scene);
  std::vector<packing::GridCandidate> candidates() const { return candidates_.to_host(count_); }

  std::size_t count() const { return count_; }  ///< cells in the list
  const packing::GridLayout& layout() const { return layout_; }

 private:
  std::uint32_t read_counter(int which);

  Queue* queue_;
  packing::GridLayout layout_;
  DeviceArray<std::uint32_t> cells_;
  std::size_t count_ = 0;
  DeviceArray<packing::GridCandidate> candidates_;
  DeviceArray<std::uint32_t> counters_;
};

}  // namespace ist::gpu
