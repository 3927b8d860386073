#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>

#include <ist/query.h>
#include <ist/types.h>

namespace IST_API ist {

/// Settings for the choice of the spheres that are intersected.
struct LensSettings {
  Measure measure = Measure::matched;  ///< matched or inner
  /// Levels of detail of the matched sets, 0 the finest; 0 for inner spheres, which have one.
  std::uint32_t detail_a = 0, detail_b = 0;
};

/// The overlap of two spheres, for drawing: an ellipsoid of this size about this centre resembles
/// it.
struct OverlapLens {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [u] middle of its thickness, world
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< unit, from A's sphere to B's, world
  double radius = 0;                                 ///< [u] where it is widest, across the axis
  double thickness = 0;                              ///< [u] along the axis
  std::uint32_t sphere_a = 0;                        ///< of A, in insertion order
  std::uint32_t sphere_b = 0;                        ///< of B
};

struct OverlapLenses {
  /// invalid_input also for Measure::exact and for a level of detail that a tree does not have.
  QueryStatus status = QueryStatus::ok;
  std::size_t total = 0;  ///< number of lenses
  std::size_t count = 0;  ///< lenses written
};

/// The lenses of two placed trees, in the order of the trees, as many as fit: those that
/// penetration() sums when it sums lenses.
///
/// For pictures: pair by pair, some ten times slower than penetration(). No allocation, lock or
/// exception. Trees may be shared by threads.
OverlapLenses overlap_lenses(const PlacedAsset& a, const PlacedAsset& b,
                             const LensSettings& settings, std::span<OverlapLens> lenses) noexcept;

}  // namespace ist
