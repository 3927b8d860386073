#pragma once

#include "base/team.h"
#include "support/fiber_team.h"

namespace ist::testing {

/// Calls work(team): of one lane or, where `seed` is not 0, of 32 that go on in an order drawn
/// from it.
template <class Work>
void by_team(unsigned seed, const Work& work) {
  if (seed == 0) {
    work(SerialTeam());
    return;
  }
  static Fibers<32> fibers(seed);
  fibers.run([&](int lane) { work(FiberTeam<32>(fibers, lane)); });
}

}  // namespace ist::testing
