#pragma once

#include <array>

#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/lod/level_chain.h"

namespace ist {

/// Whether a query is told what error it may have.
inline bool by_error(const PenetrationSettings& settings) noexcept {
  return settings.measure == Measure::matched && settings.relative_error > 0;
}

/// Says of an answer of the exact measure where its bounds, as of simplified meshes, are wider than
/// a query accepts.
inline Penetration with_error_status(Penetration exact,
                                     const PenetrationSettings& settings) noexcept {
  const double most = 2 * settings.relative_error * exact.volume;
  if (exact.status == QueryStatus::ok && by_error(settings) &&
      exact.volume_max - exact.volume_min > most && exact.volume > 0)
    exact.status = QueryStatus::error_exceeded;
  return exact;
}

/// Volume of solid for which a sphere of a level stands, the asset's unit frame. Thin solids need
/// more spheres: as many times as what inner spheres of that size leave out makes a radius larger.
double solid_volume(const AssetHeader& asset, const TreeHeader& tree) noexcept;

/// The weight that a level keeps after its comparison with a coarser one, and its slopes.
struct LevelTrust {
  double weight = 0;                ///< [0, 1]
  double by_own = 0, by_other = 0;  ///< [1/u³] by the level's volume, by the coarser one's
};

/// Which pairs of levels are predicted to err by no more than a query accepts, and are cheaper than
/// the exact measure (docs/design.md 5).
class WantedError {
 public:
  /// `exact`: the exact measure may answer.
  WantedError(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
              const PenetrationSettings& settings, const LevelChain& chain, bool exact) noexcept;

  /// Some level is exact enough at some overlap.
  bool by_spheres() const noexcept;

  struct Shares {
    LevelChain::Weights levels = {};  ///< of the chain
    LevelWeight rest{1, 0};           ///< at which no level is exact enough
  };
  /// Parts of the answer, which sum to 1: all of it is the coarsest pair's from the overlap on at
  /// which that is exact enough, none up to 0.7 of that; what is left goes to the next finer pair
  /// by the same rule. Continuous in the coarse estimate, A's unit frame, with the slope.
  Shares shares(double coarse) const noexcept;

  /// The partner of pair i in comparisons: both sides a level coarser, as far as there is one.
  const LevelPair& coarser(std::size_t i) const noexcept { return coarser_[i]; }
  /// The prediction is made from random poses. In others, such as flush faces and solids in one
  /// place, the protrusions and gaps of spheres add up to an error in proportion to their radius,
  /// which a coarser level reveals. The level is trusted if the error derived from that is below
  /// the accepted one, and if it says no more than `most`, the smaller solid's volume. [u³]
  LevelTrust trust(std::size_t i, double own, double other, double most) const noexcept;

 private:
  const double error_;
  std::size_t size_;
  std::array<LevelPair, LevelChain::kMost> coarser_;
  std::array<double, LevelChain::kMost> wider_;  ///< radii of coarser_, less 1
  std::array<double, LevelChain::kMost> from_;   ///< overlap, A's unit frame; infinity: never
};

}  // namespace ist
