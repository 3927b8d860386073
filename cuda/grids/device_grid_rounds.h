#pragma once

#include "cuda/grids/device_rounds.h"
#include "packing/grids/pack_grids.h"

namespace ist::gpu {

/// The work of a grid packing's rounds on the GPU (packing/grids/grid_rounds.h says what the calls
/// do). Must not outlive the queue.
class DeviceGridRounds {
 public:
  /// `mesh`'s exact arrays are in use until the first round.
  DeviceGridRounds(Queue& queue, const MeshView& mesh)
      : queue_(queue), grid_(queue, mesh), prototypes_(queue) {}

  void build(const packing::GridLayout& layout) { grid_.build(layout); }
  void place_prototypes(const packing::GridLayout& layout) { prototypes_.place(layout); }
  void split_prototypes() { prototypes_.split(); }
  std::vector<packing::GridCandidate> converged(const packing::AscentSettings& settings,
                                                const packing::GoOn& go_on);
  std::vector<packing::GridWinner> round(const packing::AscentSettings& settings,
                                         const packing::GoOn& go_on);
  void append(const std::vector<Sphere>& spheres);
  void update() { grid_.update(); }

 protected:
  Queue& queue_;
  DeviceGrid grid_;
  DevicePrototypes prototypes_;
};

/// Packs a mesh on the paper's grids (settings.grid, not banded): the same bytes as
/// packing::pack_grids().
SpherePacking pack_grids(Queue& queue, const MeshSolid& solid, const PackingSettings& settings,
                         Stage& stage);

}  // namespace ist::gpu
