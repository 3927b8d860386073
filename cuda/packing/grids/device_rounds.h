#pragma once

#include <vector>

#include "cuda/packing/grids/device_grid.h"
#include "packing/grids/ascent.h"

namespace ist::gpu {

/// The work of a grid packing's rounds on the GPU (packing/grids/ascent.h documents the calls), one
/// warp a prototype. Must not outlive the queue.
class DeviceRounds {
 public:
  /// The exact arrays of `mesh` must stay valid until the first round.
  DeviceRounds(Queue& queue, const MeshView& mesh)
      : queue_(queue), grid_(queue, mesh), counters_(queue, 4) {}

  void build(const packing::GridLayout& layout) { grid_.build(layout); }
  void place_prototypes(const packing::GridLayout& layout);
  void split_prototypes();
  std::vector<packing::GridCandidate> converged(const packing::AscentSettings& settings,
                                                const packing::GoOn& go_on);
  std::vector<packing::GridWinner> round(const packing::AscentSettings& settings,
                                         const packing::GoOn& go_on);
  void append(const std::vector<Sphere>& spheres);
  void update() { grid_.update(); }

 protected:
  /// Keeps the active cells and lets their prototypes converge; false if `go_on` returned false.
  bool converge(const packing::AscentSettings& settings, const packing::GoOn& go_on);

  Queue& queue_;
  DeviceGrid grid_;
  packing::GridLayout prototypes_;
  DeviceArray<std::uint32_t> cells_;  ///< active cells of the prototype grid after the last round
  std::size_t count_ = 0;             ///< of these
  DeviceArray<packing::GridCandidate> candidates_;
  DeviceArray<std::uint32_t> counters_;
};

}  // namespace ist::gpu
