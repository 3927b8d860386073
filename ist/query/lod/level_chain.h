#pragma once

#include <array>
#include <cstddef>

#include <ist/asset_layout.h>

#include "query/lod/level_pair.h"

namespace ist {

/// The pairs of levels of detail of two assets that a query may use, from the finest to the
/// coarsest of both (docs/design.md 5). Each step takes a coarser level on the side of the smaller
/// spheres, which cost most and add least, or on both sides if spheres are about as large.
///
/// The overlap of the coarsest levels, the *coarse estimate*, predicts the number of sphere pairs
/// of each level. It is smooth in the pose, so that answers may be blended by it.
class LevelChain {
 public:
  static constexpr std::size_t kMost = 2 * kMaxDetails + 1;
  using Weights = std::array<LevelWeight, kMost>;

  LevelChain() = default;  ///< not planned
  /// `scale`: of B in A's unit frame.
  LevelChain(const AssetHeader& a, const AssetHeader& b, double scale) noexcept;

  /// `level_…(i)`: level i of an asset, which has `coarser_…` levels after the finest.
  template <class LevelA, class LevelB>
  IST_HD void plan(std::uint32_t coarser_a, const LevelA& level_a, std::uint32_t coarser_b,
                   const LevelB& level_b, double scale) noexcept {
    std::uint32_t at_a = 0, at_b = 0;
    for (size_ = 0;;) {
      const LevelCost of_a = level_a(at_a), of_b = level_b(at_b);
      pairs_[size_++] = detail_pair(at_a, of_a, at_b, of_b, scale);
      const bool more_a = at_a < coarser_a, more_b = at_b < coarser_b;
      if (!more_a && !more_b) return;
      step_coarser(more_a, more_b, of_a.mean_radius, of_b.mean_radius * scale, at_a, at_b);
    }
  }

  IST_HD std::size_t size() const noexcept { return size_; }
  IST_HD const LevelPair& operator[](std::size_t i) const noexcept { return pairs_[i]; }
  IST_HD const LevelPair& coarsest() const noexcept { return pairs_[size_ - 1]; }

  /// The weight of the finest pair by a quick look, before any coarse estimate (docs/design.md 5),
  /// with its slope: 1 while it needs no more than 0.35 of `budget`, 0 from a half on.
  IST_HD LevelWeight quick_weight(double look, double budget) const noexcept {
    return affordable(pairs_[0], look, budget, kLookAlone, kLookNone);
  }

  /// Calls visit(i, weight) for every pair. The weights sum to 1: the finest pair gets all while it
  /// needs no more than 0.7 of `budget` sphere pairs, and nothing if it needs the whole; the rest
  /// goes to the next pair by the same rule, and in the end to the coarsest. Weights are continuous
  /// in `coarse` and have their slopes. An estimate of 0 selects the finest.
  ///
  /// `wanted(i)`: the weight of each pair without a budget.
  template <class Wanted, class Visit>
  IST_HD void share(double coarse, double budget, const Wanted& wanted,
                    const Visit& visit) const noexcept {
    LevelWeight rest = {};
    for (std::uint32_t i = 0; i + 1 < size_; ++i) {
      const LevelWeight part = affordable(pairs_[i], coarse, budget, kLevelAlone, kLevelNone);
      rest = rest + wanted(i);
      visit(i, rest * part);
      rest = rest * complement(part);
    }
    visit(size_ - 1, rest + wanted(size_ - 1));
  }

  Weights weights(double coarse, double budget,
                  const Weights& wanted = {LevelWeight{1, 0}}) const noexcept;

 private:
  LevelPair pairs_[kMost];
  std::uint32_t size_;
};

}  // namespace ist
