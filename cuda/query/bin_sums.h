#pragma once

#include <cstdint>

#include "cuda/atomics.h"
#include "cuda/query/patch_memory.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// Adds value(k, term) to target(key(k))[term] for k < count, in this order. A term stays with one
/// lane, which reads and writes the target where the key changes.
template <class Team, class Key, class Value, class Target>
IST_HD void add_by_runs(const Team& team, int count, const Key& key, const Value& value,
                        const Target& target) {
  for (int term = team.lane(); count > 0 && term < kTerms; term += Team::kWidth) {
    int run = key(0);
    double sum = value(0, term);
    IST_ROLLED
    for (int k = 1; k < count; ++k) {
      const int next = key(k);
      if (next != run) {
        target(run)[term] += sum;
        sum = 0;
        run = next;
      }
      sum += value(k, term);
    }
    target(run)[term] += sum;
  }
  team.sync();
}

/// Where a descent's lenses go: into the bins of one of the trees, in double.
template <class Team>
class BinSums {
 public:
  /// The bins are B's if `of_b`. Empties them.
  IST_HD BinSums(const Team& team, PatchMemory& memory, PatchBin* bins, const CutsRef& cuts,
                 bool of_b)
      : team_(team), m_(memory), bins_(bins), rank_(cuts.rank), shift_(cuts.shift), of_b_(of_b) {
    for (int w = team.lane(); w < words_of(cuts); w += Team::kWidth) m_.marked[w] = 0;
  }

  IST_HD float (&begin())[kTerms] {
    for (float& s : term_) s = 0;
    return term_;
  }

  IST_HD void end(bool flag, std::uint32_t number_a, std::uint32_t number_b) {
    const bool adds = flag && term_[kCaps] > 0;
    int total = 0;
    const int place = team_.exclusive_count(adds, total);
    const std::uint32_t bin =
        adds ? in_global_memory(rank_)[(of_b_ ? number_b : number_a) >> shift_] : 0;
    const std::uint32_t bit = 1u << bin % 32;
    const bool fresh = adds && (m_.marked[bin / 32] & bit) == 0;
    if (adds) {
      m_.bin[place] = static_cast<int>(bin);
      for (int t = 0; t < kTerms; ++t) m_.term[place][t] = term_[t];
    }
    if (team_.any(fresh) && fresh) {
      for (double& t : in_global_memory(bins_)[bin].term) t = 0;
      atomic_or(&m_.marked[bin / 32], bit);
    }
    team_.sync();
    add_by_runs(
        team_, total, [&](int k) { return m_.bin[k]; },
        [&](int k, int term) { return static_cast<double>(m_.term[k][term]); },
        [&](int run) { return in_global_memory(bins_)[run].term; });
  }

  IST_HD bool full() const { return false; }
  IST_HD void fold() {}

 private:
  const Team& team_;
  PatchMemory& m_;
  PatchBin* bins_;
  const std::uint16_t* rank_;
  int shift_;
  bool of_b_;
  float term_[kTerms] = {};  ///< this lane's
};

}  // namespace ist::gpu
