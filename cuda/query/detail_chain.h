#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/detail_ref.h"
#include "numerics/host_device.h"
#include "query/asset/shared_constants.h"

// Which levels of detail two assets are asked with under a pair budget: DetailChain
// (query/detail/detail_chain.h) in plain numbers.

namespace ist::gpu {

constexpr int kMostDetailPairs = 2 * static_cast<int>(kMaxDetails) + 1;

/// A part of an answer, with its slope by the estimate it is told from.
struct DetailShare {
  double weight, slope;
};

/// Two levels that are asked together.
struct DetailPair {
  std::uint32_t a, b;
  double density, skin;  ///< what the expected number of sphere pairs is made of

  IST_HD void describe(const DetailRef& tree_a, const DetailRef& tree_b, double scale) {
    const double volume_b = tree_b.volume_sum * (scale * scale * scale);
    const double reach = tree_a.mean_radius + tree_b.mean_radius * scale;
    const double root_b = tree_b.tree.root[3] * scale;
    const double size = tree_a.tree.root[3] < root_b ? tree_a.tree.root[3] : root_b;
    density = kPairShare * (tree_a.sphere_count / tree_a.volume_sum) *
              (tree_b.sphere_count / volume_b) * (4 * kPi / 3 * (reach * reach * reach));
    skin = kPairRim * reach * std::sqrt(size);
  }

  /// 1 where the pair needs no more than the part `alone` of the budget by an estimate of the
  /// overlap, 0 from `none` on.
  IST_HD DetailShare affordable(double estimate, double budget, double alone, double none) const {
    const double root = std::sqrt(estimate);
    const double expected = density * (estimate + skin * root);
    if (!(expected < none * budget)) return {0, 0};
    const double t = (none - expected / budget) / (none - alone);
    if (!(t < 1)) return {1, 0};
    return {t * t * (3 - 2 * t),
            -6 * t * (1 - t) / ((none - alone) * budget) * density * (1 + skin / (2 * root))};
  }
};

/// From the finest pair to the coarsest.
struct DetailChain {
  int size;
  DetailPair pair[kMostDetailPairs];

  IST_HD void plan(const AssetDetails& a, const AssetDetails& b, double scale) {
    std::uint32_t at_a = 0, at_b = 0;
    for (size = 0;;) {
      const DetailRef &tree_a = a.level[at_a], &tree_b = b.level[at_b];
      pair[size].a = at_a;
      pair[size].b = at_b;
      pair[size++].describe(tree_a, tree_b, scale);
      const bool more_a = at_a < a.coarser, more_b = at_b < b.coarser;
      if (!more_a && !more_b) return;
      const double radius_b = tree_b.mean_radius * scale;
      const double cube_a = tree_a.mean_radius * tree_a.mean_radius * tree_a.mean_radius;
      const double cube_b = radius_b * radius_b * radius_b;
      const bool step_a = more_a && (!more_b || !(kAlikeVolume * cube_a > cube_b));
      const bool step_b = more_b && (!more_a || !(kAlikeVolume * cube_b > cube_a));
      at_a += step_a ? 1 : 0;
      at_b += step_b ? 1 : 0;
    }
  }

  /// The finest pair's share whatever a coarse sum would say.
  IST_HD DetailShare sure(double look, double budget) const {
    return pair[0].affordable(look, budget, kLookAlone, kLookNone);
  }

  /// The share of pair i by a coarse sum.
  IST_HD DetailShare share(int i, double coarse, double budget) const {
    DetailShare rest = {1, 0};
    for (int k = 0; k + 1 < size; ++k) {
      const DetailShare part = pair[k].affordable(coarse, budget, kLevelAlone, kLevelNone);
      if (k == i)
        return {rest.weight * part.weight, rest.slope * part.weight + rest.weight * part.slope};
      rest = {rest.weight * (1 - part.weight),
              rest.slope * (1 - part.weight) - rest.weight * part.slope};
    }
    return rest;
  }
};

}  // namespace ist::gpu
