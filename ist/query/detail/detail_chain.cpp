#include "query/detail/detail_chain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "query/asset/shared_constants.h"
#include "query/base/smooth_step.h"

namespace ist {
namespace {

DetailPair describe(const AssetHeader& a, std::uint32_t detail_a, const AssetHeader& b,
                    std::uint32_t detail_b, double scale) {
  const TreeHeader& tree_a = matched_tree(a, detail_a);
  const TreeHeader& tree_b = matched_tree(b, detail_b);
  const double volume_b = tree_b.volume_sum * (scale * scale * scale);
  const double reach = tree_a.mean_radius + tree_b.mean_radius * scale;
  const double size = std::min(tree_a.root[3], tree_b.root[3] * scale);
  DetailPair pair;
  pair.a = detail_a;
  pair.b = detail_b;
  pair.density = kPairShare * (tree_a.sphere_count / tree_a.volume_sum) *
                 (tree_b.sphere_count / volume_b) *
                 (4 * std::numbers::pi / 3 * (reach * reach * reach));
  pair.skin = kPairRim * reach * std::sqrt(size);
  return pair;
}

/// 1 where a pair of levels needs no more than the part `alone` of the budget by an estimate of the
/// overlap, 0 from `none` on, with its slope by the estimate.
DetailWeight affordable(const DetailPair& pair, double estimate, double budget, double alone,
                        double none) {
  const double root = std::sqrt(estimate);
  const double expected = expected_pairs(pair, estimate);
  // (written so that a damaged asset's NaN takes the coarsest level)
  const double t =
      expected < none * budget ? std::min((none - expected / budget) / (none - alone), 1.0) : 0;
  DetailWeight weight{smooth_step(t), 0};
  if (t > 0 && t < 1)
    weight.slope =
        -6 * t * (1 - t) / ((none - alone) * budget) * pair.density * (1 + pair.skin / (2 * root));
  return weight;
}

}  // namespace

double expected_pairs(const DetailPair& pair, double overlap) noexcept {
  return pair.density * (overlap + pair.skin * std::sqrt(overlap));
}

DetailChain::DetailChain(const AssetHeader& a, const AssetHeader& b, double scale) noexcept {
  std::uint32_t at_a = 0, at_b = 0;
  for (;;) {
    pairs_[size_++] = describe(a, at_a, b, at_b, scale);
    const bool more_a = at_a < a.detail_count;
    const bool more_b = at_b < b.detail_count;
    if (!more_a && !more_b) return;
    const double radius_a = matched_tree(a, at_a).mean_radius;
    const double radius_b = matched_tree(b, at_b).mean_radius * scale;
    const double cube_a = radius_a * radius_a * radius_a;
    const double cube_b = radius_b * radius_b * radius_b;
    const bool step_a = more_a && (!more_b || !(kAlikeVolume * cube_a > cube_b));
    const bool step_b = more_b && (!more_a || !(kAlikeVolume * cube_b > cube_a));
    at_a += step_a ? 1 : 0;
    at_b += step_b ? 1 : 0;
  }
}

DetailWeight DetailChain::quick_weight(double look, double budget) const noexcept {
  return affordable(pairs_[0], look, budget, kLookAlone, kLookNone);
}

DetailChain::Weights DetailChain::weights(double coarse, double budget,
                                          const Weights& wanted) const noexcept {
  Weights weights;
  DetailWeight rest;
  for (std::size_t i = 0; i + 1 < size_; ++i) {
    const DetailWeight part = affordable(pairs_[i], coarse, budget, kLevelAlone, kLevelNone);
    rest = rest + wanted[i];
    weights[i] = rest * part;
    rest = rest * complement(part);
  }
  weights[size_ - 1] = rest + wanted[size_ - 1];
  return weights;
}

}  // namespace ist
