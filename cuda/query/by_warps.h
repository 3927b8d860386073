#pragma once

// Device code only.

#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/batch_arrays.h"
#include "cuda/warp_team.h"

namespace ist::gpu {

/// Lists pair i where `list` says: 0 float, 1 double, −1 nowhere. All of a warp together.
__device__ inline void list_pair(const BatchArrays& batch, std::uint32_t i, int list) {
  const WarpTeam team;
  for (int kind = 0; kind < 2; ++kind) {
    int total = 0;
    const int before = team.exclusive_count(list == kind, total);
    if (total == 0) continue;
    std::uint32_t first = 0;
    if (team.lane() == 0)
      first = atomic_add(&batch.counters->listed[kind], static_cast<std::uint32_t>(total));
    first = team.broadcast(first, 0);
    if (list == kind) batch.list[kind][first + static_cast<std::uint32_t>(before)] = i;
  }
}

/// Calls work(team, k) for k < count, each warp taking the next when it is done with one.
template <class Work>
__device__ void by_warps(std::uint32_t count, std::uint32_t* taken, const Work& work) {
  const WarpTeam team;
  for (;;) {
    std::uint32_t k = 0;
    if (team.lane() == 0) k = atomic_add(taken, 1);
    k = team.broadcast(k, 0);
    if (k >= count) return;
    work(team, k);
  }
}

}  // namespace ist::gpu
