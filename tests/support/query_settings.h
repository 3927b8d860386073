#pragma once

#include <ist/query.h>

namespace ist::testing {

/// The same limits for a separation.
inline SeparationSettings for_separation(const PenetrationSettings& s) {
  return {s.max_visits, false, 0, s.pair_id};
}

/// The same limits for both halves of query().
inline QuerySettings for_both(const PenetrationSettings& s) { return {s, for_separation(s)}; }

}  // namespace ist::testing
