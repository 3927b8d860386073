#pragma once

#include <array>

#include <ist/asset_layout.h>

#include "query/detail/detail_pair.h"

namespace ist {

/// The pairs of levels with which two assets may be asked, from the finest to the coarsest of both
/// (docs/design.md 5). Each step takes a coarser level on the side of the smaller spheres, which
/// cost most and tell least, or on both sides where spheres are about as large.
///
/// How many sphere pairs a level needs is told from the overlap of the coarsest levels, the
/// *coarse estimate*: a smooth function of the pose, so that an answer may be blended by it.
class DetailChain {
 public:
  static constexpr std::size_t kMost = 2 * kMaxDetails + 1;
  using Weights = std::array<DetailWeight, kMost>;

  /// `scale`: of B in A's unit frame.
  DetailChain(const AssetHeader& a, const AssetHeader& b, double scale) noexcept;

  std::size_t size() const noexcept { return size_; }
  const DetailPair& operator[](std::size_t i) const noexcept { return pairs_[i]; }
  const DetailPair& coarsest() const noexcept { return pairs_[size_ - 1]; }

  /// Part of the answer that the finest pair gives whatever a coarse estimate would say, by what a
  /// quick look sees (docs/design.md 5), with the slope: 1 while that needs no more than 0.35 of
  /// `budget`, 0 from a half on.
  DetailWeight quick_weight(double look, double budget) const noexcept;

  /// Weights of the pairs, which sum to 1: all of it is the finest pair's while that needs no more
  /// than 0.7 of `budget` sphere pairs, none where it needs the whole; what is left goes to the
  /// next pair by the same rule, and what none can afford to the coarsest. Continuous in `coarse`,
  /// with the slope. An estimate of 0: the finest.
  ///
  /// `wanted`: what each pair would give without a budget, if that is not all the finest.
  Weights weights(double coarse, double budget,
                  const Weights& wanted = {DetailWeight{1, 0}}) const noexcept;

 private:
  std::array<DetailPair, kMost> pairs_;
  std::size_t size_ = 0;
};

}  // namespace ist
