#pragma once

#include "cuda/base/queue.h"
#include "cuda/packing/banded/banded_state.h"
#include "mesh/hierarchy/wide_tree.h"

namespace ist::gpu {

/// Where the blocks of a cooperative kernel meet; zero before the first launch.
struct CoopBarrier {
  std::uint32_t here;
  std::uint32_t generation;
};

/// Enqueues a cooperative kernel that packs from the step that the state says until it is finished
/// or needs something (banded_loop.h).
void launch_banded(Queue& queue, const BandedArrays& arrays, const WideTree& mesh,
                   CoopBarrier* barrier);

}  // namespace ist::gpu
