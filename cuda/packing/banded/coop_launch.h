#pragma once

#include <cstdint>

#include "cuda/base/atomics.h"

// A cooperative launch is the set of teams that work on one packing: the warps of a kernel, or a
// few threads of the host (tests). Steps are templates over it. It has
//
//   using Team;             const Team& team() const;
//   using Lane;             a team of a single lane
//   Scratch& scratch();     this team's own memory
//   std::uint32_t index();  this team's number, below size()
//   void pause();           waits briefly for other teams
//   void sync(last);        a barrier: the last team to arrive runs last(), then all continue and
//                           see what any of them wrote before
namespace ist::gpu {

/// Calls work(i) for all i < count, a team an item, in fixed shares: for items of equal work.
template <class CoopLaunch, class Work>
IST_HD void distribute_statically(CoopLaunch& coop, std::uint32_t count, const Work& work) {
  for (std::uint32_t i = coop.index(); i < count; i += coop.size()) work(i);
}

/// The same, each team taking the next item when it is free. `taken` starts at 0.
template <class CoopLaunch, class Work>
IST_HD void distribute_dynamically(CoopLaunch& coop, std::uint32_t count, std::uint32_t* taken,
                                   const Work& work) {
  std::uint32_t i = coop.index();
  while (i < count) {
    work(i);
    if (count <= coop.size()) return;
    i = coop.size() + take(coop.team(), taken, 1);
  }
}

/// Calls work(i) for all i < count, a lane an item. All lanes of a team make the calls together. If
/// i ≥ count, `work` is called too, and must only take part in the team's collective operations.
template <class CoopLaunch, class Work>
IST_HD void distribute_to_lanes(CoopLaunch& coop, std::uint32_t count, const Work& work) {
  constexpr auto kWidth = static_cast<std::uint32_t>(CoopLaunch::Team::kWidth);
  const std::uint32_t stride = coop.size() * kWidth;
  for (std::uint32_t base = coop.index() * kWidth; base < count; base += stride)
    work(base + static_cast<std::uint32_t>(coop.team().lane()));
}

}  // namespace ist::gpu
