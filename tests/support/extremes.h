#pragma once

#include <string>
#include <vector>

namespace ist::testing {

/// One promise about an extreme input, and its measurement.
struct Claim {
  std::string what;  ///< the measured quantity, with its unit
  double worst = 0;  ///< largest that was measured
  double limit = 0;  ///< what is promised; infinity: nothing is, the figure is there to be known
  bool is_kept() const { return worst <= limit; }  ///< NaN is not
};

/// An extreme input (docs/design.md 3.1, 3.4, 3.6, 7) and all that is promised for it.
struct Extreme {
  const char* name;
  const char* input;
  std::vector<Claim> (*claims)();
};

/// Every extreme that benchmarks/results/extremes.md lists, in its order. Needs no data.
const std::vector<Extreme>& extremes();

}  // namespace ist::testing
