#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>

#include <string>
#include <vector>

#include "bake/check/check_surface.h"

namespace ist {

/// What of a mesh bounds its solid.
enum class Bounding {
  all,     ///< all triangles
  shells,  ///< some of them, shell by shell: others lie within it
  parts    ///< parts of them: they meet each other
};

/// The surface by itself, or what of its triangles bounds the solid shell by shell.
CheckSurface boundary_of(const CheckSurface& surface, Bounding bounding);

/// `kept` and the solid's boundary lie within `error` of each other, unit frame. `what`: its name.
std::vector<Invariant> check_near(const std::string& what, const CheckSurface& kept,
                                  const CheckSurface& boundary, double error, Bounding bounding);

/// The field of an asset that has one, against the mesh and by itself: closed, near the solid's
/// surface, its balls and its cells.
std::vector<Invariant> check_field(const AssetHeader& asset, const CheckSurface& surface,
                                   Bounding bounding);

/// The triangles of a field by block and lane.
class FieldTriangles {
 public:
  FieldTriangles(const AssetHeader& asset, const FieldHeader& field)
      : blocks_(at<SurfaceBlock>(asset, field.level[0].blocks)), count_(field.level[0].count) {}

  std::size_t blocks() const { return count_; }
  std::uint32_t lanes(std::size_t block) const { return blocks_[block].triangles; }
  CheckSurface::Corners corners(std::size_t block, std::uint32_t lane) const {
    CheckSurface::Corners out;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = blocks_[block].corner[k][lane];
      out[k] = {blocks_[block].x[v], blocks_[block].y[v], blocks_[block].z[v]};
    }
    return out;
  }
  std::vector<CheckSurface::Corners> all() const {
    std::vector<CheckSurface::Corners> out;
    for (std::size_t b = 0; b < count_; ++b)
      for (std::uint32_t l = 0; l < lanes(b); ++l) out.push_back(corners(b, l));
    return out;
  }

 private:
  const SurfaceBlock* blocks_;
  std::size_t count_;
};

/// Cells hold what meets them, and their bits are true. `surface`: the boundary of the solid.
std::vector<Invariant> check_field_cells(const AssetHeader& asset, const FieldHeader& field,
                                         const CheckSurface& of_field, const CheckSurface& surface);

/// The mesh of an asset that has one, against the mesh that was baked and by itself: its triangles
/// or its error, closed, its blocks, neighbours, shells and boxes.
///
/// `closed`: what was baked; `surface`: the same in the unit frame, `frame`.
std::vector<Invariant> check_kept_mesh(const AssetHeader& asset, const ClosedMesh& closed,
                                       const UnitFrame& frame, const CheckSurface& surface,
                                       Bounding bounding);

}  // namespace ist
