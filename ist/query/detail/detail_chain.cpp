#include "query/detail/detail_chain.h"

namespace ist {
DetailChain::DetailChain(const AssetHeader& a, const AssetHeader& b, double scale) noexcept {
  std::uint32_t at_a = 0, at_b = 0;
  for (;;) {
    const TreeHeader &tree_a = matched_tree(a, at_a), &tree_b = matched_tree(b, at_b);
    pairs_[size_++] =
        detail_pair(at_a, tree_a, tree_a.root[3], at_b, tree_b, tree_b.root[3], scale);
    const bool more_a = at_a < a.detail_count;
    const bool more_b = at_b < b.detail_count;
    if (!more_a && !more_b) return;
    step_coarser(more_a, more_b, tree_a.mean_radius, tree_b.mean_radius * scale, at_a, at_b);
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
