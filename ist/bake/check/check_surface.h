#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>

#include <string>
#include <vector>

#include "bake/check/checked_mesh.h"

namespace ist {

/// What of a mesh bounds its solid.
enum class Bounding {
  all,     ///< all triangles
  shells,  ///< some of them, shell by shell: others lie within it
  parts    ///< parts of them: they meet each other
};

/// The surface by itself, or what of its triangles bounds the solid shell by shell.
CheckedMesh boundary_of(const CheckedMesh& surface, Bounding bounding);

/// `kept` and the solid's boundary lie within `error` of each other, unit frame. `what`: its name.
std::vector<Invariant> check_near(const std::string& what, const CheckedMesh& kept,
                                  const CheckedMesh& boundary, double error, Bounding bounding);

/// The surface of an asset that has one, against the mesh and by itself: closed, near the solid's,
/// its balls and its cells.
std::vector<Invariant> check_surface(const AssetHeader& asset, const CheckedMesh& mesh,
                                     Bounding bounding);

/// The triangles of a surface by block and lane.
class SurfaceTriangles {
 public:
  SurfaceTriangles(const AssetHeader& asset, const SurfaceHeader& surface)
      : blocks_(at<SurfaceBlock>(asset, surface.level[0].blocks)), count_(surface.level[0].count) {}

  std::size_t blocks() const { return count_; }
  std::uint32_t lanes(std::size_t block) const { return blocks_[block].triangles; }
  CheckedMesh::Corners corners(std::size_t block, std::uint32_t lane) const {
    CheckedMesh::Corners out;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = blocks_[block].corner[k][lane];
      out[k] = {blocks_[block].x[v], blocks_[block].y[v], blocks_[block].z[v]};
    }
    return out;
  }
  std::vector<CheckedMesh::Corners> all() const {
    std::vector<CheckedMesh::Corners> out;
    for (std::size_t b = 0; b < count_; ++b)
      for (std::uint32_t l = 0; l < lanes(b); ++l) out.push_back(corners(b, l));
    return out;
  }

 private:
  const SurfaceBlock* blocks_;
  std::size_t count_;
};

/// Cells hold what meets them, and their bits are true. `solid`: the boundary of the solid.
std::vector<Invariant> check_surface_cells(const AssetHeader& asset, const SurfaceHeader& surface,
                                           const CheckedMesh& of_surface, const CheckedMesh& solid);

/// The mesh of an asset that has one, against the mesh that was baked and by itself: its triangles
/// or its error, closed, its blocks, neighbours, shells and boxes.
///
/// `closed`: what was baked; `surface`: the same in the unit frame, `frame`.
std::vector<Invariant> check_kept_mesh(const AssetHeader& asset, const ClosedMesh& closed,
                                       const UnitFrame& frame, const CheckedMesh& surface,
                                       Bounding bounding);

}  // namespace ist
