#pragma once

#include <ist/mesh.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "mesh/disjoint_sets.h"
#include "mesh/mesh_solid.h"
#include "mesh/mesh_view.h"

namespace ist {

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

  /// `p`: unit frame.
  double at(const double p[3]) const;

 private:
  /// Triangles seen from afar.
  struct Far {
    double centre[3] = {};
    double area = 0;
    double reach2 = -1;     ///< beyond this squared distance of the centre they count together
    double dipole[3] = {};  ///< Σ area · normal
    double second[9] = {};  ///< Σ area · normal ⊗ (centroid − centre), rows by the normal's axis
  };

  Far far_of_block(std::uint32_t block) const;
  Far far_of(std::uint32_t child, const BvhNode& parent, int place);

  const MeshView& mesh_;
  std::vector<std::array<Far, kBvhWidth>> of_children_;  ///< by node
};

/// Any triangles, to be asked for closest points; inside() and volume() mean nothing.
std::unique_ptr<MeshSolid> triangles_as_solid(TriangleMesh mesh);

/// Coincident triangles reduced to their signed sum, and the patches of the others turned outward.
TriangleMesh turned_outward(TriangleMesh mesh);

/// The generalised winding number of triangles as they face. Ask it from any thread.
class [[gnu::visibility("hidden")]] TriangleWinding {
 public:
  explicit TriangleWinding(TriangleMesh mesh);

  /// `x`: [u]. 0 where there are no triangles.
  double at(const Eigen::Vector3d& x) const;

 private:
  std::unique_ptr<MeshSolid> surface_;
  std::optional<SoupWinding> winding_;
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
