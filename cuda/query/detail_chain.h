#pragma once

#include <cstdint>

#include "cuda/query/detail_ref.h"
#include "numerics/host_device.h"
#include "query/detail/detail_pair.h"

// Which levels of detail two assets are asked with under a pair budget: DetailChain
// (query/detail/detail_chain.h) in plain numbers.

namespace ist::gpu {

constexpr int kMostDetailPairs = 2 * static_cast<int>(kMaxDetails) + 1;

/// From the finest pair to the coarsest.
struct DetailChain {
  int size;
  DetailPair pair[kMostDetailPairs];

  IST_HD void plan(const AssetDetails& a, const AssetDetails& b, double scale) {
    std::uint32_t at_a = 0, at_b = 0;
    for (size = 0;;) {
      const DetailRef &of_a = a.level[at_a], &of_b = b.level[at_b];
      pair[size++] =
          detail_pair(at_a, of_a, of_a.tree.root[3], at_b, of_b, of_b.tree.root[3], scale);
      const bool more_a = at_a < a.coarser, more_b = at_b < b.coarser;
      if (!more_a && !more_b) return;
      step_coarser(more_a, more_b, of_a.mean_radius, of_b.mean_radius * scale, at_a, at_b);
    }
  }

  /// The finest pair's share whatever a coarse sum would say.
  IST_HD DetailWeight sure(double look, double budget) const {
    return affordable(pair[0], look, budget, kLookAlone, kLookNone);
  }

  /// The share of pair i by a coarse sum.
  IST_HD DetailWeight share(int i, double coarse, double budget) const {
    DetailWeight rest = {1, 0};
    for (int k = 0; k + 1 < size; ++k) {
      const DetailWeight part = affordable(pair[k], coarse, budget, kLevelAlone, kLevelNone);
      if (k == i) return rest * part;
      rest = rest * complement(part);
    }
    return rest;
  }
};

}  // namespace ist::gpu
