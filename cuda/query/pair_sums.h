#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/pair_memory.h"

namespace ist::gpu {

/// Receives a traversal's lenses: adds them to one sum, the pair's.
template <class Team>
class PairSums {
 public:
  IST_HD PairSums(const Team& team, PairMemory& memory) : team_(team), m_(memory) {
    for (float& s : sum_) s = 0;
  }

  /// The sum to which the lane's next lenses are added.
  IST_HD float (&begin())[kTerms] { return sum_; }
  /// Ends a round of lenses, whose spheres have these numbers if `flag`. Called by all lanes.
  IST_HD void end(bool, std::uint32_t, std::uint32_t) { ++summed_; }

  /// A lane adds few numbers in float before they continue in double.
  IST_HD bool full() const { return summed_ >= 16; }

  IST_HD void fold() {
    if (summed_ > 0) {
      const double back = 1 / m_.unit;
      for (int k = 0; k < kTerms; ++k) {
        const double sum = team_.sum(static_cast<double>(sum_[k]));
        sum_[k] = 0;
        if (team_.lane() != 0) continue;
        m_.totals.term[k] += sum * term_factor(back, k);
      }
    }
    summed_ = 0;
  }

 private:
  const Team& team_;
  PairMemory& m_;
  float sum_[kTerms];  ///< this lane's
  int summed_ = 0;     ///< numbers in it, at most
};

}  // namespace ist::gpu
