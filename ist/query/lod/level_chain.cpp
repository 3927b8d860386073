#include "query/lod/level_chain.h"

namespace ist {

LevelChain::LevelChain(const AssetHeader& a, const AssetHeader& b, double scale) noexcept {
  plan(
      a.detail_count, [&](std::uint32_t i) { return LevelCost::of(matched_tree(a, i)); },
      b.detail_count, [&](std::uint32_t i) { return LevelCost::of(matched_tree(b, i)); }, scale);
}

LevelChain::Weights LevelChain::weights(double coarse, double budget,
                                        const Weights& wanted) const noexcept {
  Weights weights = {};
  share(
      coarse, budget, [&](std::size_t i) { return wanted[i]; },
      [&](std::size_t i, const LevelWeight& weight) { weights[i] = weight; });
  return weights;
}

}  // namespace ist
