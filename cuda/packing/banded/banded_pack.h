#pragma once

#include <ist/bake.h>

#include "base/stage.h"
#include "cuda/base/queue.h"
#include "mesh/hierarchy/wide_tree.h"
#include "packing/banded/band_schedule.h"

namespace ist::gpu {

/// packing::BandedPacker on the GPU: the same spheres, bit for bit. `mesh` is in device memory. The
/// caller sets the result's frame.
SpherePacking pack_banded(Queue& queue, const WideTree& mesh, const packing::PackingLimits& limits,
                          Stage& stage);

}  // namespace ist::gpu
