#pragma once

#include "cuda/base/queue.h"
#include "cuda/packing/banded/banded_state.h"
#include "mesh/hierarchy/wide_tree.h"

namespace ist::gpu {

/// A barrier of the blocks of a cooperative kernel; zero before the first launch.
struct CoopBarrier {
  std::uint32_t here;
  std::uint32_t generation;
};

/// Enqueues a cooperative kernel that packs from the state's step on until it is finished or needs
/// larger buffers (banded_loop.h).
void launch_banded(Queue& queue, const BandedArrays& arrays, const WideTree& mesh,
                   CoopBarrier* barrier);

}  // namespace ist::gpu
