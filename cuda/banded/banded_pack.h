#pragma once

#include <ist/packing.h>

#include "cuda/queue.h"
#include "mesh/wide_tree.h"
#include "packing/banded/band_schedule.h"
#include "stage/stage.h"

namespace ist::gpu {

/// What a packing took, for notes and benchmarks.
struct BandedCost {
  std::uint64_t cells_worked = 0;
  std::uint32_t levels = 0;    ///< dependent steps of work on cells
  std::uint32_t steps = 0;     ///< all dependent steps
  std::uint32_t launches = 0;  ///< 1 + how often an array was too small
  /// [s] of the device: work on cells, their splitting, selection with certification, the sphere
  /// grid, the rest.
  double work = 0, split = 0, select = 0, grid = 0, rest = 0;
};

/// packing::BandedPacker on the GPU: the same spheres, bit for bit. `mesh` is in device memory. The
/// result's frame is left to the caller.
SpherePacking pack_banded(Queue& queue, const WideTree& mesh, const packing::PackingLimits& limits,
                          Stage& stage, BandedCost* cost = nullptr);

}  // namespace ist::gpu
