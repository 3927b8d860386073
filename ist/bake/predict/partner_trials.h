#pragma once

#include <ist/asset.h>
#include <ist/query.h>
#include <functional>

#include "mesh/mesh_solid.h"

namespace ist {

/// About `count` points [u] spread evenly over the solid: the share of them inside a body is about
/// the share of the solid's volume in it. Same points on any machine and for any number of threads;
/// runs on the caller's TBB threads.
std::vector<Eigen::Vector3d> inner_points(const MeshSolid& solid, std::size_t count);

/// [u³] The ball's volume inside the solid, to rounding; the winding number of the mesh must be 0
/// or 1 at every point. Visits every triangle.
double ball_part(const MeshSolid& solid, const Eigen::Vector3d& centre, double radius);

/// A solid, at rest, and an overlapping partner of another shape and size.
struct PartnerTrial {
  PlacedShape partner;  ///< in the solid's frame
  double volume = 0;    ///< [u³] of the overlap
};

/// The partners of the trials other than a copy of the solid.
inline constexpr TrialPartner kOtherPartners[] = {TrialPartner::plane, TrialPartner::ball,
                                                  TrialPartner::edge, TrialPartner::corner,
                                                  TrialPartner::plate};

/// Finds trials of partners other than a copy.
///
/// Balls and boxes measure 0.1 to 0.3 of the solid's diagonal, plates are 0.02 of it thick. Each
/// approaches from outside along a random direction, towards a random point of the solid, until it
/// shares a volume within half a decade of the wanted one. Places are found by points of the solid
/// alone, so that they favour no packing; volumes are exact.
///
/// Deterministic for a seed, on any machine. Runs on the caller's TBB threads.
class PartnerTrials {
 public:
  /// `mesh`: an asset that contains the solid's own triangles. Both must outlive this.
  PartnerTrials(const MeshSolid& solid, const AssetView& mesh);

  /// About `count` trials with overlaps near `overlap` of the solid's volume; fewer or none if the
  /// partner is too small for that. `go_on(part)`, if any, is called every few milliseconds with
  /// the finished part of [0, 1]; once it returns false, the trials so far are returned.
  std::vector<PartnerTrial> find(TrialPartner partner, double overlap, std::uint32_t count,
                                 std::uint64_t seed,
                                 const std::function<bool(double)>& go_on = {}) const;

 private:
  const MeshSolid& solid_;
  const AssetView mesh_;
  const std::vector<Eigen::Vector3d> points_;
  double diagonal_ = 0;  ///< [u] of the solid's bounds
};

}  // namespace ist
