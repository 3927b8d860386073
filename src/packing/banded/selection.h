#pragma once

#include <vector>

#include "packing/banded/candidate.h"

namespace ist::packing {

/// A candidate that none before it overlaps.
struct Winner {
  std::uint32_t index = 0;  ///< among the candidates
  double gap = 0;           ///< to the winners that go before it, see gap_to_sphere()
};

/// The candidates that no candidate that goes before them overlaps, in that order.
std::vector<Winner> select_independent(const std::vector<Candidate>& candidates);

}  // namespace ist::packing
