#pragma once

#include <ist/mesh.h>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/hierarchy/winding.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// One place a row, with its winding number.
using WindingPlaces = Eigen::Matrix<double, kWindingPoints, 3>;
using WindingNumbers = Eigen::Array<double, kWindingPoints, 1>;

/// The generalised winding number of any triangles (Jacobson et al. 2013): the sum of their signed
/// solid angles over 4π. About a closed surface it is the winding number; about an open one it
/// falls from 1 to 0 across the holes.
///
/// Distant triangles are combined by the first two terms of their field (Barill et al. 2018), near
/// ones are summed one by one: the result is within 0.01 of the sum. Immutable and thread-safe.
class SoupWinding {
 public:
  /// `mesh` must have its hierarchy and outlive this.
  explicit SoupWinding(const MeshView& mesh);

  /// `x`: places in the unit frame.
  WindingNumbers at_each(const WindingPlaces& x) const;
  double at(const Eigen::Vector3d& x) const;

 private:
  FarTriangles far_of_block(std::uint32_t block) const;
  FarTriangles far_of(std::uint32_t child, const BvhNode& parent, int place);

  const MeshView& mesh_;
  std::vector<FarChildren> of_children_;  ///< by node
};

/// Any triangles, for closest-point queries; inside() and volume() are meaningless.
std::unique_ptr<MeshSolid> triangles_as_solid(TriangleMesh mesh);

/// Reduces coincident triangles to their signed sum, and orients the other patches outward.
TriangleMesh turned_outward(TriangleMesh mesh);

/// The generalised winding number of triangles as oriented. Thread-safe.
class [[gnu::visibility("hidden")]] TriangleWinding {
 public:
  explicit TriangleWinding(TriangleMesh mesh);

  /// True if the winding number's magnitude is surely less than ½, as at a place far from little
  /// area.
  bool surely_less_than_half(const Eigen::Vector3d& x) const {
    return !winding_ || bounds_.squaredExteriorDistance(x) > least_distance2_;
  }

  /// `x`: [u]. 0 if there are no triangles.
  WindingNumbers at_each(const WindingPlaces& x) const;
  double at(const Eigen::Vector3d& x) const {
    return at_each(WindingPlaces(x.transpose().replicate<kWindingPoints, 1>()))[0];
  }

 private:
  std::unique_ptr<MeshSolid> surface_;
  std::optional<SoupWinding> winding_;
  Eigen::AlignedBox3d bounds_;   ///< [u]
  double least_distance2_ = -1;  ///< [u²] from the bounds: beyond it all area covers less than 2π
};

/// The same for any triangles, whatever their orientation.
struct [[gnu::visibility("hidden")]] OutwardWinding : TriangleWinding{
  explicit OutwardWinding(TriangleMesh mesh) : TriangleWinding(turned_outward(std::move(mesh))){}
};

/// [triangle] True if its patch, one of those in `asked` (by their first triangles), is an inner
/// wall: it is invisible from far away, and without all such walls the winding number about it is
/// 1.
std::vector<bool> inner_walls(const TriangleMesh& soup, DisjointSets& patches,
                              const std::vector<bool>& asked);

}  // namespace ist
