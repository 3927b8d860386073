#include "bake/field/solid_surface.h"

#include <cstddef>

#include "bake/field/overlaps.h"
#include "bake/field/winding_sides.h"

namespace ist {

std::optional<SolidSurface> SolidSurface::of(const MeshSolid& solid, double enough) {
  if (!solid.may_overlap()) return SolidSurface(solid);
  if (!solid.meets_itself()) return of_shells(solid);
  const std::optional<Overlaps> overlaps = find_overlaps(solid);
  if (!overlaps || overlaps->off > enough) return std::nullopt;
  SolidSurface surface(solid);
  surface.off_ = overlaps->off;
  return surface;
}

// A shell of which one side is solid already, or both sides are not yet, is no boundary.
std::optional<SolidSurface> SolidSurface::of_shells(const MeshSolid& solid) {
  SolidSurface surface(solid);
  const MeshView& mesh = solid.arrays();
  const std::vector<std::optional<int>> outside =
      windings_outside(solid, std::vector<std::uint8_t>(mesh.triangle_count));
  std::vector<std::uint32_t>& kept = surface.triangles_;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    if (!outside[t]) return std::nullopt;
    if (*outside[t] == 0)
      kept.insert(kept.end(), mesh.triangles + 3 * t, mesh.triangles + 3 * t + 3);
  }
  if (kept.empty()) return std::nullopt;
  surface.arrays_.triangle_count = static_cast<std::uint32_t>(kept.size() / 3);
  if (surface.arrays_.triangle_count == mesh.triangle_count) kept.clear();
  if (!kept.empty()) surface.arrays_.triangles = kept.data();
  return surface;
}

const MeshView& SolidSurface::view() {
  if (triangles_.empty()) return solid_->view();
  if (!hierarchy_) {
    hierarchy_ = build_bvh({arrays_.vertices, 3 * std::size_t{arrays_.vertex_count}}, triangles_);
    view_ = arrays_;
    view_.nodes = hierarchy_->nodes.get();
    view_.blocks = hierarchy_->blocks.get();
    view_.root = hierarchy_->root;
  }
  return view_;
}

}  // namespace ist
