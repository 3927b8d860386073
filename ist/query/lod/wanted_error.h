#pragma once

#include <array>

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/lod/level_chain.h"

namespace ist {

/// True if a query has a wanted error.
inline bool by_error(const PenetrationSettings& settings) noexcept {
  return settings.measure == Measure::matched && settings.relative_error > 0;
}

/// Sets error_exceeded if the bounds of an exact answer are wider than the query accepts.
inline Penetration with_error_status(Penetration exact,
                                     const PenetrationSettings& settings) noexcept {
  const double most = 2 * settings.relative_error * exact.volume;
  if (exact.status == QueryStatus::ok && by_error(settings) &&
      exact.volume_max - exact.volume_min > most && exact.volume > 0)
    exact.status = QueryStatus::error_exceeded;
  return exact;
}

/// The volume of solid that a sphere of a level represents, the asset's unit frame. It is larger
/// for thin solids, of which inner spheres leave much out.
double solid_volume(const AssetHeader& asset, const TreeHeader& tree) noexcept;

/// The weight that a level keeps after its comparison with a coarser one, and its slopes.
struct LevelTrust {
  double weight = 0;                ///< [0, 1]
  double by_own = 0, by_other = 0;  ///< [1/u³] by the level's volume, by the coarser one's
};

/// Selects the pairs of levels that are predicted to err by no more than a query accepts, and to be
/// cheaper than the exact measure (docs/design.md 5).
class WantedError {
 public:
  /// `exact`: the exact measure may answer.
  WantedError(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
              const PenetrationSettings& settings, const LevelChain& chain, bool exact) noexcept;

  /// True if some level is accurate enough at some overlap.
  bool by_spheres() const noexcept;

  struct Shares {
    LevelChain::Weights levels = {};  ///< of the chain
    LevelWeight rest{1, 0};           ///< left to no level
  };
  /// Weights, which sum to 1. The coarsest pair gets all from the overlap on at which it is
  /// accurate enough, and nothing up to 0.7 of that; the rest goes to the next finer pair by the
  /// same rule. Continuous in the coarse estimate, A's unit frame, with slopes.
  Shares shares(double coarse) const noexcept;

  /// The pair with which pair i is compared: both sides a level coarser, if there is one.
  const LevelPair& coarser(std::size_t i) const noexcept { return coarser_[i]; }
  /// Predictions are fitted to random poses. In others, such as flush faces and coincident solids,
  /// protrusions and gaps of spheres add up to an error in proportion to their radius, which a
  /// coarser level reveals. The level is trusted if the error derived from that is below the
  /// accepted one, and its volume is no more than `most`, the smaller solid's. [u³]
  LevelTrust trust(std::size_t i, double own, double other, double most) const noexcept;

 private:
  const double error_;
  std::size_t size_;
  std::array<LevelPair, LevelChain::kMost> coarser_;
  std::array<double, LevelChain::kMost> wider_;  ///< radii of coarser_, less 1
  std::array<double, LevelChain::kMost> from_;   ///< overlap, A's unit frame; infinity: never
};

}  // namespace ist
