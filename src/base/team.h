#pragma once

#include <cstdint>

#include "base/bits.h"

// A team is the set of threads that work on one item together: one on the CPU, a warp on the GPU
// (cuda/base/warp_team.h). Shared numerics are templates over it and loop
//
//   for (int i = team.lane(); i < count; i += Team::kWidth)
//
// Its reductions are minima, maxima and integer sums, which do not depend on the order: any width
// gives the same bits. Floats and doubles are compared by the order of their bits, in which −0 <
// +0; NaN is not allowed. All lanes must make the same calls.

namespace ist {

/// A team of one thread, for the host (and for a single thread of the device).
struct SerialTeam {
  static constexpr int kWidth = 1;

  IST_HD int lane() const { return 0; }
  IST_HD void sync() const {}

  static constexpr int kBatch = 64;  ///< items that are worth processing together

  /// Marks a pointer to memory that the team's lanes share.
  template <class T>
  IST_HD T* memory(T* p) const {
    return p;
  }

  template <class T>
  IST_HD T min(T value) const {
    return value;
  }
  template <class T>
  IST_HD T max(T value) const {
    return value;
  }
  IST_HD int sum(int value) const { return value; }
  IST_HD double sum(double value) const { return value; }  ///< in a fixed order for each width
  IST_HD bool any(bool flag) const { return flag; }
  IST_HD bool all(bool flag) const { return flag; }

  /// The number of lanes before this one that raise the flag; `total`: of all lanes.
  IST_HD int exclusive_count(bool flag, int& total) const {
    total = flag ? 1 : 0;
    return 0;
  }

  /// Bit k: lane k raises the flag.
  IST_HD std::uint32_t ballot(bool flag) const { return flag ? 1 : 0; }

  /// Bit k: lane k has the same value.
  IST_HD std::uint32_t alike(std::uint32_t) const { return 1; }

  /// The lowest lane that raises the flag, −1 if none does; `total`: their number.
  IST_HD int first(bool flag, int& total) const {
    total = flag ? 1 : 0;
    return flag ? 0 : -1;
  }

  /// The value of lane `from`, which may differ between lanes.
  template <class T>
  IST_HD T broadcast(T value, int from) const {
    (void)from;
    return value;
  }
};

}  // namespace ist
