#pragma once

#include <algorithm>
#include <optional>

#include <ist/query.h>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/descent/workspace.h"

namespace ist {

/// How two trees are to be asked (docs/design.md 7.1). The pose has no say in it.
struct PairMethod {
  bool lenses = true;
  bool surface = false;  ///< the finer tree's spheres in the coarser one's surface
  bool b_probes = true;  ///< whose spheres those are
  /// Overlap by lenses, A's unit frame: up to `full` the surface answers alone, from `none` on the
  /// lenses do.
  double full = 0, none = 0;
  double share = 1;  ///< what "alone" is of trees that are all but alike: the rest is the lenses'
};

/// The part of a solid that inner spheres cover, or the least that counts.
inline double covered_part(const AssetHeader& asset) noexcept {
  return std::max(asset.coverage, 0.01);
}

PairMethod pair_method(const PlacedTree& a, const TreeHeader& tree_a, const PlacedTree& b,
                       const TreeHeader& tree_b, const RelativePose& pose, SurfaceUse use) noexcept;

/// Whether a surface must be used that the coarser asset does not hold.
inline bool lacks_surface(const PairMethod& method, SurfaceUse use) noexcept {
  return use == SurfaceUse::always && method.lenses;
}

/// The surface's weight by what lenses say, A's unit frame, and its slope by that. The finished
/// sum's weight lies from `least` to `most`.
struct SurfaceWeight {
  double weight = 1, slope = 0;
  double least = 1, most = 1;
};
SurfaceWeight surface_weight(const PairMethod& method, const Penetration& lenses,
                             double unit3) noexcept;

/// What two trees of placed assets overlap by: a sum of lenses, the sum by the surface, or both
/// blended by the lenses' volume. Gradients are the returned sum's.
class PairOverlap {
 public:
  PairOverlap(const PlacedTree& a, const TreeHeader& tree_a, const PlacedTree& b,
              const TreeHeader& tree_b, const RelativePose& pose, Workspace::Impl& scratch) noexcept
      : a_(a), b_(b), tree_a_(tree_a), tree_b_(tree_b), pose_(pose), scratch_(scratch) {}

  Penetration by_lenses(const DescentLimits& limits) noexcept;
  Penetration by_surface(bool b_probes, const DescentLimits& limits,
                         ContactBins* bins = nullptr) noexcept;
  Penetration by(const PairMethod& method, const DescentLimits& limits) noexcept;

  /// What the lenses leave of the limits for the surface; nothing if no visits are left.
  static std::optional<DescentLimits> left_by(const Penetration& lenses,
                                              DescentLimits limits) noexcept;

  /// The lenses' sum blended with the surface's, which is summed within what is left. With `bins`,
  /// those of what probes, it is sorted into them too.
  Penetration with_surface(const PairMethod& method, const Penetration& lenses,
                           const SurfaceWeight& weight, const DescentLimits& left,
                           ContactBins* bins = nullptr) noexcept;

  /// What the lenses say, where no visits are left for the surface.
  Penetration without_surface(const PairMethod& method, Penetration lenses) const noexcept;

 private:
  const PlacedTree& a_;
  const PlacedTree& b_;
  const TreeHeader& tree_a_;
  const TreeHeader& tree_b_;
  const RelativePose& pose_;
  Workspace::Impl& scratch_;
};

/// Both sums by weight, counts and status being the surface's. `unit3`: volume of A's unit.
Penetration blended(const Penetration& lenses, Penetration surface, const SurfaceWeight& weight,
                    double unit3) noexcept;

}  // namespace ist
