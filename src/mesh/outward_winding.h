#pragma once

#include <ist/mesh.h>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/hierarchy/winding.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// A place a row, and the winding number there.
using WindingPlaces = Eigen::Matrix<double, kWindingPoints, 3>;
using WindingNumbers = Eigen::Array<double, kWindingPoints, 1>;

/// The generalised winding number of any triangles (Jacobson et al. 2013): the sum of their signed
/// solid angles over 4π. About a closed surface it is the winding number; about an open one it
/// falls from 1 to 0 across the holes.
///
/// Far triangles count together, by the first two terms of their field (Barill et al. 2018), near
/// ones each by itself: within 0.01 of the sum. Immutable; ask it from any thread.
class SoupWinding {
 public:
  /// `mesh`: with its hierarchy; it must outlive this.
  explicit SoupWinding(const MeshView& mesh);

  /// Places in the unit frame.
  WindingNumbers at_each(const WindingPlaces& x) const;
  double at(const Eigen::Vector3d& x) const;

 private:
  FarTriangles far_of_block(std::uint32_t block) const;
  FarTriangles far_of(std::uint32_t child, const BvhNode& parent, int place);

  const MeshView& mesh_;
  std::vector<FarChildren> of_children_;  ///< by node
};

/// Any triangles, to be asked for closest points; inside() and volume() mean nothing.
std::unique_ptr<MeshSolid> triangles_as_solid(TriangleMesh mesh);

/// Coincident triangles reduced to their signed sum, and the patches of the others turned outward.
TriangleMesh turned_outward(TriangleMesh mesh);

/// The generalised winding number of triangles as they face. Ask it from any thread.
class [[gnu::visibility("hidden")]] TriangleWinding {
 public:
  explicit TriangleWinding(TriangleMesh mesh);

  /// Whether the winding number's magnitude is surely less than ½, as it is far from little area.
  bool surely_less_than_half(const Eigen::Vector3d& x) const {
    return !winding_ || bounds_.squaredExteriorDistance(x) > least_distance2_;
  }

  /// `x`: [u]. 0 where there are no triangles.
  WindingNumbers at_each(const WindingPlaces& x) const;
  double at(const Eigen::Vector3d& x) const {
    return at_each(WindingPlaces(x.transpose().replicate<kWindingPoints, 1>()))[0];
  }

 private:
  std::unique_ptr<MeshSolid> surface_;
  std::optional<SoupWinding> winding_;
  Eigen::AlignedBox3d bounds_;   ///< [u]
  double least_distance2_ = -1;  ///< [u²] from the bounds, from where all area covers less than 2π
};

/// The same of any triangles, however they face.
struct [[gnu::visibility("hidden")]] OutwardWinding : TriangleWinding{
  explicit OutwardWinding(TriangleMesh mesh) : TriangleWinding(turned_outward(std::move(mesh))){}
};

/// [triangle] whether its patch, one of those `asked` for by their first triangles, is an inner
/// wall: nobody sees it from far away, and without all such the winding number is 1 about it.
std::vector<bool> inner_walls(const TriangleMesh& soup, DisjointSets& patches,
                              const std::vector<bool>& asked);

}  // namespace ist
